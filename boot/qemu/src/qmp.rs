//! QMP, QEMU's control protocol: one JSON object a line.

use std::io::{self, Write};
use std::os::unix::net::UnixStream;

use serde_json::{Value, json};

/// The sending end of QEMU's control socket.
#[derive(Debug)]
pub struct Control {
    socket: UnixStream,
    sent: u64,
}

impl Control {
    /// Sends commands over `socket`.
    pub fn new(socket: UnixStream) -> Self {
        Self { socket, sent: 0 }
    }

    /// Sends a command and returns the `id` that its reply will carry.
    ///
    /// # Errors
    /// QEMU has closed the socket, or has not read for as long as the socket's write timeout.
    pub fn send(&mut self, execute: &str, arguments: Value) -> io::Result<u64> {
        self.sent += 1;
        let command = json!({ "execute": execute, "arguments": arguments, "id": self.sent });
        self.socket.write_all(format!("{command}\n").as_bytes())?;
        Ok(self.sent)
    }
}

/// Returns whether QEMU's message is the reply to the command with this `id`.
pub fn is_reply(message: &Value, id: u64) -> bool {
    message.get("id").and_then(Value::as_u64) == Some(id)
}
