//! Child processes that end with this program.
//!
//! All uses of `setpriv` and of shell scripts to start a process are in this module.
//!
//! A host program that is killed must not leave a QEMU, a download or a compiler behind. No clean-up code of
//! ours can run after a `SIGKILL`, so the operating system has to end the children. Linux does so by the
//! parent-death signal, which a child requests for itself. util-linux's `setpriv` makes the request where it
//! is installed. Without `setpriv`, children still end with every ordinary end of this program.
//!
//! No crate replaces `setpriv`: a process can set the signal only for itself, so a crate (`rustix`, `nix`,
//! `process-wrap`, `command-group`) would still need `CommandExt::pre_exec`, which is unsafe.
//!
//! **The signal belongs to the thread** that started the child, not to the process: Linux sends it when that
//! thread ends. So one thread starts the child and waits for it. [`run`] and [`watch`] return only after the
//! child has ended.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Read};
use std::os::fd::OwnedFd;
use std::os::unix::process::CommandExt;
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use anyhow::Context;
use console::strip_ansi_codes;
use rustix::process::{Pid, Signal, kill_process_group};

use crate::interrupt::{Interrupted, interrupted};

/// Lines of a failed child's error output that the error message repeats.
const TAIL_LINES: usize = 20;

/// Arguments in front of the program's name when `setpriv` starts the program.
const WRAPPER_ARGUMENTS: usize = 8;

/// Ends at once if the parent ended before `setpriv` made its request: the signal would never come.
const SINGLE_SCRIPT: &str = r#"[ "$PPID" = "$1" ] || exit 1; shift; exec "$@""#;

/// The same for a program that starts others: the shell stays, leads the process group, and ends all of it.
const GROUP_SCRIPT: &str =
    r#"trap 'kill -KILL 0' TERM; [ "$PPID" = "$1" ] || exit 1; shift; "$@" & wait $!"#;

/// The descriptors of the sockets of [`command_with_sockets`] in the child.
pub const SOCKETS: [i32; 2] = [3, 4];

/// Moves the sockets from standard input and output to the descriptors [`SOCKETS`].
///
/// The standard library passes only the standard descriptors to a child. A descriptor that every child
/// inherits would also reach the children of other threads, and this program would then not notice that the
/// child has closed its end.
const SOCKETS_SCRIPT: &str = r#"exec "$@" 3<&0 4>&1 </dev/null >&2"#;

/// Returns a command whose process ends with this program, even by `SIGKILL`.
///
/// Use it for one long-lived process, such as QEMU. The process has the id that [`Command::spawn`] reports.
/// With `setpriv`, a missing program gives exit code 127 and no error of `spawn`, so find the program first.
/// The [module](self) explains the rule about threads.
pub fn command(program: impl AsRef<OsStr>) -> Command {
    with_death_signal("KILL", SINGLE_SCRIPT, program.as_ref())
}

/// Returns a command as [`command`] does, whose process also has `sockets` as the descriptors [`SOCKETS`].
/// Its standard input is empty, and its standard output goes to standard error.
pub fn command_with_sockets(program: impl AsRef<OsStr>, sockets: [OwnedFd; 2]) -> Command {
    let [first, second] = sockets;
    let mut command = command("sh");
    command.args(["-c", SOCKETS_SCRIPT, "sh"]).arg(program);
    command.stdin(first).stdout(second);
    command
}

/// Returns a command for a program that starts others, such as cargo or apt-get: all of them end with this
/// program.
///
/// Grandchildren do not inherit the parent-death signal, so a shell receives it for the whole process group.
/// Only [`run`] and [`watch`] make that group.
pub fn family(program: impl AsRef<OsStr>) -> Command {
    with_death_signal("TERM", GROUP_SCRIPT, program.as_ref())
}

fn with_death_signal(signal: &str, script: &str, program: &OsStr) -> Command {
    static SETPRIV: OnceLock<Option<std::path::PathBuf>> = OnceLock::new();
    let Some(setpriv) = SETPRIV.get_or_init(|| which::which("setpriv").ok()) else {
        return Command::new(program);
    };
    let mut command = Command::new(setpriv);
    command.args(["--pdeathsig", signal, "--", "sh", "-c", script, "sh"]);
    command.arg(std::process::id().to_string()).arg(program);
    command
}

/// An event of a running child, which [`watch`] reports.
#[derive(Debug, Clone, Copy)]
pub enum ChildEvent<'a> {
    /// A line of its error output.
    Line(&'a str),
    /// Time has passed; reported a few times a second.
    Tick,
}

/// Runs a command to its end and returns its output.
///
/// # Errors
/// The command cannot be started, or fails: the message has the command line and the last lines of its error
/// output. [`Interrupted`] if the user stops this program; the child has then been killed.
pub fn run(command: &mut Command) -> anyhow::Result<String> {
    watch(command, |_| {})
}

/// Runs a command as [`run`] does, and reports each line of its error output and the passing of time.
///
/// # Errors
/// As [`run`].
pub fn watch(command: &mut Command, mut report: impl FnMut(ChildEvent)) -> anyhow::Result<String> {
    const TICK: Duration = Duration::from_millis(200);
    let line = line(command);
    // In a separate process group, Ctrl-C and failure can end the children's children as well.
    command
        .process_group(0)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = command
        .spawn()
        .with_context(|| format!("`{line}` cannot be started"))?;
    let (send, receive) = mpsc::channel();
    let readers = [
        child
            .stdout
            .take()
            .map(|pipe| read_lines(pipe, send.clone(), Stream::Out)),
        child
            .stderr
            .take()
            .map(|pipe| read_lines(pipe, send, Stream::Err)),
    ];
    let (mut output, mut errors) = (String::new(), Vec::new());
    let mut ticked = Instant::now();
    let mut ended = None;
    let status = loop {
        match receive.recv_timeout(TICK.saturating_sub(ticked.elapsed())) {
            Ok((Stream::Out, text)) => output.push_str(&text),
            Ok((Stream::Err, text)) => {
                report(ChildEvent::Line(text.trim_end()));
                errors.push(text);
            }
            // The pipes are closed; the child is about to end.
            Err(RecvTimeoutError::Disconnected) => std::thread::sleep(Duration::from_millis(1)),
            Err(RecvTimeoutError::Timeout) => {}
        }
        if interrupted() {
            // If the child has just ended, there is no group to kill.
            let _ = kill_process_group(Pid::from_child(&child), Signal::KILL);
            child.wait()?;
            return Err(Interrupted.into());
        }
        if ended.is_none() {
            ended = child.try_wait()?.map(|status| (status, Instant::now()));
        }
        // A background process that the child left may hold the pipes open. Do not wait for it.
        if let Some((status, since)) = ended
            && (readers.iter().flatten().all(|reader| reader.is_finished())
                || since.elapsed() > 2 * TICK)
        {
            for (stream, text) in receive.try_iter() {
                match stream {
                    Stream::Out => output.push_str(&text),
                    Stream::Err => {
                        report(ChildEvent::Line(text.trim_end()));
                        errors.push(text);
                    }
                }
            }
            break status;
        }
        if ticked.elapsed() >= TICK {
            ticked = Instant::now();
            report(ChildEvent::Tick);
        }
    };
    if status.success() {
        return Ok(output);
    }
    let tail = errors[errors.len().saturating_sub(TAIL_LINES)..].concat();
    anyhow::bail!("`{line}` failed ({status})\n{}", tail.trim_end());
}

#[derive(Clone, Copy)]
enum Stream {
    Out,
    Err,
}

fn read_lines(
    pipe: impl Read + Send + 'static,
    send: Sender<(Stream, String)>,
    stream: Stream,
) -> std::thread::JoinHandle<()> {
    std::thread::spawn(move || {
        let mut pipe = BufReader::new(pipe);
        let mut bytes = Vec::new();
        while pipe
            .read_until(b'\n', &mut bytes)
            .is_ok_and(|read| read > 0)
        {
            let text = String::from_utf8_lossy(&bytes);
            let text = match stream {
                Stream::Out => text,
                // Some programs colour their messages even into a pipe.
                Stream::Err => strip_ansi_codes(&text).into_owned().into(),
            };
            if send.send((stream, text.into_owned())).is_err() {
                return;
            }
            bytes.clear();
        }
    })
}

/// Returns the command line as a user would type it into a shell, without the wrapper of `setpriv` and `sh`.
pub fn line(command: &Command) -> String {
    let all = [command.get_program()]
        .into_iter()
        .chain(command.get_args());
    let wrapped = command
        .get_args()
        .next()
        .is_some_and(|first| first == "--pdeathsig");
    let words = all.skip(if wrapped { 1 + WRAPPER_ARGUMENTS } else { 0 });
    words
        .map(|word| quoted(&word.to_string_lossy()))
        .collect::<Vec<_>>()
        .join(" ")
}

/// Returns a word, quoted for the shell where necessary.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_@%+=:,./-".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixStream;
    use std::os::unix::process::ExitStatusExt;

    use super::*;

    fn shell(script: &str) -> Command {
        let mut command = family("sh");
        command.args(["-c", script]);
        command
    }

    #[test]
    fn output_is_returned_and_error_output_is_reported_by_line() {
        let mut lines = Vec::new();
        let output = watch(
            &mut shell("echo one; echo two >&2; printf three >&2; echo four"),
            |event| {
                if let ChildEvent::Line(line) = event {
                    lines.push(line.to_owned());
                }
            },
        );
        assert_eq!(output.unwrap(), "one\nfour\n");
        assert_eq!(lines, ["two", "three"]);
    }

    #[test]
    fn a_failed_command_is_reported_with_its_last_lines() {
        let error = run(&mut shell("seq 1 50 >&2; exit 3"))
            .unwrap_err()
            .to_string();
        assert!(
            error.starts_with("`sh -c 'seq 1 50 >&2; exit 3'` failed (exit status: 3)\n31\n"),
            "{error}"
        );
        assert!(error.ends_with("\n50"), "{error}");
        let error = run(&mut command("/no/such/program"))
            .unwrap_err()
            .to_string();
        assert!(error.contains("/no/such/program"), "{error}");
    }

    #[test]
    fn the_command_line_can_be_pasted_into_a_shell() {
        let words = [
            "-name",
            "Crystal Ball",
            "",
            "it's",
            "a$b`c`\"d\"",
            "\n",
            "id=x,a@b%c+:./_",
            "ä",
        ];
        for mut printf in [command("printf"), family("printf")] {
            let line = line(printf.arg(r"%s\0").args(words));
            assert!(
                line.starts_with(r"printf '%s\0' -name 'Crystal Ball' '' 'it'\''s' "),
                "{line}"
            );
            let read = run(command("sh").args(["-c", &line])).unwrap();
            assert_eq!(read, words.map(|word| format!("{word}\0")).concat());
        }
    }

    #[test]
    fn run_does_not_wait_for_a_background_process_that_holds_the_pipes() {
        let begun = Instant::now();
        run(command("sh").args(["-c", "sleep 20 & echo"])).unwrap();
        assert!(begun.elapsed() < Duration::from_secs(10));
    }

    #[test]
    fn a_command_gets_its_sockets_as_descriptors_3_and_4() {
        let [(mut first, child_first), (mut second, child_second)] =
            [(); 2].map(|()| UnixStream::pair().unwrap());
        let mut command = command_with_sockets("sh", [child_first.into(), child_second.into()]);
        command.args(["-c", "echo three >&3; echo four >&4"]);
        assert!(command.status().unwrap().success());
        // The command holds the child's ends of the sockets.
        drop(command);
        for (socket, expected) in [(&mut first, "three\n"), (&mut second, "four\n")] {
            let mut text = String::new();
            socket.read_to_string(&mut text).unwrap();
            assert_eq!(text, expected);
        }
    }

    #[test]
    fn a_child_ends_with_the_thread_that_started_it() {
        let spawn = || {
            let mut command = command("sh");
            let mut child = command
                .args(["-c", "echo; exec sleep 30"])
                .stdout(Stdio::piped())
                .spawn()
                .unwrap();
            // Its first byte comes after the request for the signal.
            child.stdout.take().unwrap().read_exact(&mut [0]).unwrap();
            child
        };
        let mut child = std::thread::spawn(spawn).join().unwrap();
        assert_eq!(child.wait().unwrap().signal(), Some(9));
    }
}
