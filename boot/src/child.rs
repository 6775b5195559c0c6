//! Every child process the project starts, tied to this program's life.
//!
//! A host program that is killed must not leave a QEMU, a download or a compiler behind. `SIGKILL`
//! cannot be caught, so no clean-up code of ours can do that: the kernel has to. Linux does it with the
//! parent-death signal, which a child asks for itself; std offers that only through unsafe code, so
//! util-linux's `setpriv` asks instead, where it is installed. Without it children still die with every
//! ordinary end of this program.
//!
//! **The signal is tied to the thread** that started the child, not to the process: it is sent when that
//! thread ends. So a child is started and waited for on one and the same thread, one that lives as long as
//! the child. [`run`] and [`watch`] keep to that by not returning before the child has ended.

use std::ffi::OsStr;
use std::fmt;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::CommandExt;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::sync::{Once, OnceLock};
use std::time::{Duration, Instant};

use anyhow::Context;
use console::strip_ansi_codes;
use rustix::process::{Pid, Signal, kill_process_group};

/// How much of a failed child's error output its error message repeats.
const TAIL_LINES: usize = 20;

/// The arguments before the program's own name, in a command that goes through `setpriv`.
const TIED_ARGUMENTS: usize = 8;

/// The parent may be gone before `setpriv` has asked for the signal, which then never comes: compare.
const ALONE: &str = r#"[ "$PPID" = "$1" ] || exit 1; shift; exec "$@""#;

/// The same for a family: the shell stays, leads the process group and takes all of it with it.
const FAMILY: &str =
    r#"trap 'kill -KILL 0' TERM; [ "$PPID" = "$1" ] || exit 1; shift; "$@" & wait $!"#;

/// A command whose process dies with this program, `SIGKILL` included.
///
/// For one long-lived process, such as QEMU: the process has the id that [`Command::spawn`] reports.
/// Where `setpriv` is used a missing program is exit code 127, not an error of `spawn`: look it up first.
/// See the [module](self) about threads.
pub fn command(program: impl AsRef<OsStr>) -> Command {
    tied("KILL", ALONE, program.as_ref())
}

/// As [`command`], for a program that starts others (cargo, apt-get): all of them die.
///
/// The parent-death signal is not inherited by grandchildren, so a shell receives it for the whole process
/// group. Only for [`run`] and [`watch`], which make that group.
pub fn family(program: impl AsRef<OsStr>) -> Command {
    tied("TERM", FAMILY, program.as_ref())
}

fn tied(signal: &str, script: &str, program: &OsStr) -> Command {
    static SETPRIV: OnceLock<Option<std::path::PathBuf>> = OnceLock::new();
    let Some(setpriv) = SETPRIV.get_or_init(|| which::which("setpriv").ok()) else {
        return Command::new(program);
    };
    let mut command = Command::new(setpriv);
    command.args(["--pdeathsig", signal, "--", "sh", "-c", script, "sh"]);
    command.arg(std::process::id().to_string()).arg(program);
    command
}

/// What [`watch`] tells about a child that runs.
#[derive(Debug, Clone, Copy)]
pub enum Event<'a> {
    /// A line of its error output.
    Line(&'a str),
    /// Some time has passed (a few times a second).
    Tick,
}

/// Runs a command to its end and returns its output.
///
/// # Errors
/// When it cannot be started or fails (with the command line and the last lines of its error output), or
/// [`Interrupted`] when the user stops this program: the child has then been killed.
pub fn run(command: &mut Command) -> anyhow::Result<String> {
    watch(command, |_| {})
}

/// As [`run`], and tells what the child writes to its error output, and that time passes.
///
/// # Errors
/// As [`run`].
pub fn watch(command: &mut Command, mut tell: impl FnMut(Event)) -> anyhow::Result<String> {
    const TICK: Duration = Duration::from_millis(200);
    let line = line(command);
    // A group of its own, so that Ctrl-C and failure can end the children's children too.
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
                tell(Event::Line(text.trim_end()));
                errors.push(text);
            }
            // The pipes are closed: what is left is its end.
            Err(RecvTimeoutError::Disconnected) => std::thread::sleep(Duration::from_millis(1)),
            Err(RecvTimeoutError::Timeout) => {}
        }
        if interrupted() {
            // It may have ended just now; then there is no group to kill.
            let _ = kill_process_group(Pid::from_child(&child), Signal::KILL);
            child.wait()?;
            return Err(Interrupted.into());
        }
        if ended.is_none() {
            ended = child.try_wait()?.map(|status| (status, Instant::now()));
        }
        // A background process that it left behind may hold the pipes open: it is not waited for.
        if let Some((status, since)) = ended
            && (readers.iter().flatten().all(|reader| reader.is_finished())
                || since.elapsed() > 2 * TICK)
        {
            for (stream, text) in receive.try_iter() {
                match stream {
                    Stream::Out => output.push_str(&text),
                    Stream::Err => {
                        tell(Event::Line(text.trim_end()));
                        errors.push(text);
                    }
                }
            }
            break status;
        }
        if ticked.elapsed() >= TICK {
            ticked = Instant::now();
            tell(Event::Tick);
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
                // A program that is set to colour its messages does so into pipes, too.
                Stream::Err => strip_ansi_codes(&text).into_owned().into(),
            };
            if send.send((stream, text.into_owned())).is_err() {
                return;
            }
            bytes.clear();
        }
    })
}

/// The command line as the user would type it into a shell, without what ties it to this program.
pub fn line(command: &Command) -> String {
    let own = [command.get_program()]
        .into_iter()
        .chain(command.get_args());
    let tied = command
        .get_args()
        .next()
        .is_some_and(|first| first == "--pdeathsig");
    let words = own.skip(if tied { 1 + TIED_ARGUMENTS } else { 0 });
    words
        .map(|word| quoted(&word.to_string_lossy()))
        .collect::<Vec<_>>()
        .join(" ")
}

/// A word for the shell.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_@%+=:,./-".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// From now on Ctrl-C, `SIGTERM` and `SIGHUP` are noted (see [`interrupted`]) instead of ending the program,
/// so that it can remove its temporary folders. A second one ends it at once.
pub fn catch_interrupts() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let caught = ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::Relaxed) {
                std::process::exit(Interrupted::EXIT_CODE);
            }
        });
        // Without the handler Ctrl-C ends the program at once; the next set-up removes what stays.
        drop(caught);
    });
}

/// Whether the user has asked to stop since [`catch_interrupts`].
pub fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// The error of work that was stopped by the user.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interrupted;

impl Interrupted {
    /// What a shell reports for a program ended by Ctrl-C.
    pub const EXIT_CODE: i32 = 130;
}

impl fmt::Display for Interrupted {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("interrupted")
    }
}

impl std::error::Error for Interrupted {}

#[cfg(test)]
mod tests {
    use std::os::unix::process::ExitStatusExt;

    use super::*;

    fn shell(script: &str) -> Command {
        let mut command = family("sh");
        command.args(["-c", script]);
        command
    }

    #[test]
    fn output_is_returned_and_errors_are_told_by_line() {
        let mut lines = Vec::new();
        let output = watch(
            &mut shell("echo one; echo two >&2; printf three >&2; echo four"),
            |event| {
                if let Event::Line(line) = event {
                    lines.push(line.to_owned());
                }
            },
        );
        assert_eq!(output.unwrap(), "one\nfour\n");
        assert_eq!(lines, ["two", "three"]);
    }

    #[test]
    fn failure_names_the_command_and_ends_with_its_last_words() {
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
    fn line_is_what_a_shell_reads_as_the_same_words() {
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
    fn background_process_with_our_pipes_is_not_waited_for() {
        let begun = Instant::now();
        run(command("sh").args(["-c", "sleep 20 & echo"])).unwrap();
        assert!(begun.elapsed() < Duration::from_secs(10));
    }

    #[test]
    fn child_dies_with_the_thread_that_started_it() {
        let spawn = || {
            let mut command = command("sh");
            let mut child = command
                .args(["-c", "echo; exec sleep 30"])
                .stdout(Stdio::piped())
                .spawn()
                .unwrap();
            // It has said something, so it has asked for the signal.
            child.stdout.take().unwrap().read_exact(&mut [0]).unwrap();
            child
        };
        let mut child = std::thread::spawn(spawn).join().unwrap();
        assert_eq!(child.wait().unwrap().signal(), Some(9));
    }
}
