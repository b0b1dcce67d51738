-- Run once, when the database's volume is empty: the role as which servers and workers log in. It owns nothing;
-- `actuary migrate --service-role service` lets it in.
\set ON_ERROR_STOP on
\set password `cat /run/secrets/service_password`
create role service login password :'password';
