//! Reads tables of `supple log export`.

/// Splits a line of a table into cells; a quoted cell may contain commas.
pub fn cells(line: &str) -> Vec<&str> {
    let mut quoted = false;
    let at_comma = move |c: char| {
        quoted ^= c == '"';
        c == ',' && !quoted
    };
    line.split(at_comma).collect()
}
