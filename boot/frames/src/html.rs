//! Escapes text for HTML.
//!
//! The two pages of this project (`report`, and the page of `trade`) are built with `write!`, without a
//! template crate: both are mostly tables, whose rows `write!` states as plainly.

/// Returns text escaped for HTML, including an attribute's quotes.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            '\'' => escaped += "&#39;",
            c => escaped.push(c),
        }
    }
    escaped
}

/// Returns the start of a page, up to the end of its head. `style` follows the common style sheet.
pub fn head(title: &str, style: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{} - Crystal Ball</title>\n<style>\n{STYLE}{style}</style>\n</head>\n",
        escape(title)
    )
}

/// The style sheet of both pages.
pub(crate) const STYLE: &str = include_str!("report.css");
