//! QMP: one JSON object a line.

use std::io::{self, Write};

use serde_json::{Value, json};

/// Sends a command.
pub fn send(to: &mut impl Write, execute: &str, arguments: Value) -> io::Result<()> {
    let mut line = json!({ "execute": execute, "arguments": arguments }).to_string();
    line.push('\n');
    to.write_all(line.as_bytes())
}
