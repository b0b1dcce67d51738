-- Uploads may bring an own diagnosis instead of samples, and results then name no mask: an older build would take both
-- for damage.
update schema_info set version = 13, min_binary = 13;
