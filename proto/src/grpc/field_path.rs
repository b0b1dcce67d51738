//! Names of fields in protobuf's manner.

/// The protobuf field path of a JSON pointer: `#/strain/wavelengths_nm/3` is
/// `strain.wavelengths_nm[3]`.
pub fn field_path(pointer: &str) -> String {
    let mut path = String::new();
    for step in pointer.trim_start_matches('#').split('/').filter(|step| !step.is_empty()) {
        if step.bytes().all(|byte| byte.is_ascii_digit()) {
            path.push_str(&format!("[{step}]"));
        } else {
            if !path.is_empty() {
                path.push('.');
            }
            path.push_str(step);
        }
    }
    path
}

#[cfg(test)]
mod tests {
    use super::field_path;

    #[test]
    fn pointers_become_paths() {
        assert_eq!(field_path("#/samples/3"), "samples[3]");
        assert_eq!(field_path("#/strain/wavelengths_nm/0"), "strain.wavelengths_nm[0]");
        assert_eq!(field_path("#"), "");
    }
}
