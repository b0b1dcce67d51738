//! Tables as RFC 4180 wants them.

/// One record with its end of line.
pub fn line(fields: impl IntoIterator<Item = String>) -> String {
    let fields: Vec<String> = fields.into_iter().map(quoted).collect();
    fields.join(",") + "\r\n"
}

/// A field, in quotes where it holds what would end it.
fn quoted(field: String) -> String {
    if field.contains(['"', ',', '\r', '\n']) { format!("\"{}\"", field.replace('"', "\"\"")) } else { field }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_end_a_field_is_quoted() {
        let fields = ["plain", "a,b", "say \"x\"", "", "two\nlines"].map(str::to_owned);
        assert_eq!(line(fields), "plain,\"a,b\",\"say \"\"x\"\"\",,\"two\nlines\"\r\n");
    }
}
