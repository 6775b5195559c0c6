//! A running QEMU with our image in it: booted, talked to, and judged.
//!
//! The verdict is made out here, so that a crash of the kernel is a result and not an accident.
//! Three sources decide it, and QEMU's exit code 0 is none of them, since a triple fault, a
//! closed window and a killed QEMU all end that way:
//!
//! - the serial line: what the kernel said, and its last words;
//! - QMP, QEMU's control socket: the reason of the `SHUTDOWN` event;
//! - the code that the kernel wrote to `isa-debug-exit`.
//!
//! QEMU runs with `-no-reboot -no-shutdown`: after a reset it stands still instead of leaving, so
//! a last screendump can be taken. Threads only read (serial, QMP, QEMU's words, its end) and
//! feed one channel; everything is decided on the caller's thread.

mod patience;
mod qmp;
mod verdict;

use std::collections::VecDeque;
use std::ffi::OsString;
use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow, bail};
use link::{
    ADAPTER, Command, Content, END_OF_REPORT, ERROR, EXCEPTION, Exit, HELLO, LOADED, Lines, OK,
    PANIC, REFUSED, RUNNING,
};
use rustix::process::{Pid, Signal, kill_process_group, test_kill_process};
use serde_json::{Value, json};
use tempfile::TempDir;

use patience::Patience;
pub use verdict::{Failure, Verdict};

use crate::card::Card;
use crate::child;
use crate::dump::Dump;
use crate::screen::Screen;
use crate::setup::Ready;

/// How often a running show is asked for a sign of life.
const HEARTBEAT: Duration = Duration::from_secs(5);
/// How often waiting looks up, for Ctrl-C.
const LOOK_UP: Duration = Duration::from_millis(50);

/// How long a run may keep this program waiting.
///
/// A limit counts the processor time that QEMU uses; a QEMU that idles reaches it by the clock,
/// and 15 times the limit by the clock is the end in any case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// From QEMU's start to the kernel's first line.
    pub boot: Duration,
    /// For each answer of the kernel and of QEMU, and for QEMU's end.
    pub answer: Duration,
}

impl Default for Limits {
    /// At least ten times what each takes on a quiet machine: 1.2 s for a boot (2.5 s from an IDE
    /// disk), 1 s for a dump of all video memory.
    fn default() -> Self {
        Self {
            boot: Duration::from_secs(20),
            answer: Duration::from_secs(10),
        }
    }
}

/// What to boot, and how.
#[derive(Clone, Debug)]
pub struct Config {
    /// QEMU's program.
    pub qemu: PathBuf,
    /// The disk image.
    pub image: PathBuf,
    /// QEMU's `-vga`.
    pub vga: String,
    /// QEMU's `-display`; `none` without a window.
    pub display: String,
    /// The checksum of the pack that the kernel has to take. Without one it need not, and what it
    /// says of it is kept ([`Machine::said_of_pack`]).
    pub pack: Option<u32>,
    /// More arguments for QEMU.
    pub arguments: Vec<OsString>,
    /// Where the evidence of a failure is kept, in a folder of its own each time.
    pub failures: PathBuf,
    /// How long to wait for the machine.
    pub limits: Limits,
}

impl Config {
    /// The image on QEMU's standard adapter, without a window; evidence is kept beside the image.
    pub fn new(ready: &Ready) -> Self {
        Self {
            qemu: ready.qemu.path.clone(),
            image: ready.image.clone(),
            vga: "std".into(),
            display: "none".into(),
            pack: None,
            arguments: Vec::new(),
            failures: ready.image.with_file_name("failures"),
            limits: Limits::default(),
        }
    }
}

/// A QEMU that runs our image. Dropping it ends QEMU.
#[derive(Debug)]
pub struct Machine {
    events: Receiver<Event>,
    serial: UnixStream,
    control: UnixStream,
    process: Pid,
    /// The QEMU command line, the serial log, QEMU's words: kept on failure.
    folder: TempDir,
    failures: PathBuf,
    limits: Limits,
    seen: Seen,
    lines: VecDeque<String>,
    answers: VecDeque<Value>,
}

/// What decides the verdict, as far as it is known.
#[derive(Debug, Default)]
struct Seen {
    /// The kernel's first line.
    hello: bool,
    /// What the kernel said of its ramdisk's pack.
    pack: Option<String>,
    /// The kernel was asked to leave.
    leaving: bool,
    /// The window was told to pause the machine.
    paused: bool,
    /// Why QEMU says that the machine shut down.
    shutdown: Option<String>,
    /// The lines of a panic or exception.
    report: Vec<String>,
    /// QEMU's own words.
    words: Vec<String>,
    /// QEMU's end.
    ended: Option<ExitStatus>,
    /// Everything that the kernel said has been read.
    serial_closed: bool,
}

enum Event {
    Line(String),
    Garbled(String),
    Control(Value),
    Words(String),
    Ended(std::io::Result<ExitStatus>),
    SerialClosed,
}

impl Machine {
    /// Starts QEMU and waits for the kernel's first line.
    ///
    /// # Errors
    /// A [`Failure`] with the verdict, or why QEMU could not be started at all.
    pub fn boot(config: &Config) -> anyhow::Result<Self> {
        if config
            .arguments
            .iter()
            .any(|argument| argument == "-daemonize")
        {
            bail!("QEMU must stay this program's child, or nothing could end it: no -daemonize");
        }
        let folder = tempfile::Builder::new()
            .prefix("crystal-ball-")
            .tempdir()
            .context("no temporary folder for QEMU's sockets")?;
        let control_socket = listen(&folder.path().join("qmp"))?;
        let serial_socket = listen(&folder.path().join("serial"))?;
        let (send, events) = mpsc::channel();
        let command = command_line(config, folder.path());
        std::fs::write(
            folder.path().join("command.txt"),
            child::line(&command) + "\n",
        )?;
        let process = start(command, send.clone())?;
        let accept = |socket, name| accept(socket, process, config.limits.answer, name);
        let connected = accept(&control_socket, "its control socket")
            .and_then(|control| Ok((control, accept(&serial_socket, "the serial line")?)));
        let (control, serial) = match connected {
            Ok(streams) => streams,
            Err(error) => return Err(never_connected(error, process, &events, &folder, config)),
        };
        read_control(control.try_clone()?, send.clone());
        read_serial(serial.try_clone()?, folder.path(), send)?;
        let mut machine = Self {
            events,
            serial,
            control,
            process,
            folder,
            failures: config.failures.clone(),
            limits: config.limits,
            seen: Seen::default(),
            lines: VecDeque::new(),
            answers: VecDeque::new(),
        };
        machine.negotiate()?;
        let mut patience = Patience::new(process, config.limits.boot);
        while !machine.seen.hello {
            if !machine.pump_or_wait(&mut patience)? {
                return Err(machine.fail(Verdict::BootLoader { reset: false }));
            }
        }
        if let Some(pack) = config.pack {
            machine.wait_for_pack(pack)?;
        }
        Ok(machine)
    }

    /// Waits until the kernel has taken the pack of this checksum.
    fn wait_for_pack(&mut self, pack: u32) -> anyhow::Result<()> {
        let mut patience = Patience::new(self.process, self.limits.answer);
        while self.seen.pack.is_none() {
            if !self.pump_or_wait(&mut patience)? {
                return Err(self.fail(Verdict::Hang {
                    waited_for: "what the kernel says of the model".into(),
                }));
            }
        }
        match self.said_of_pack() {
            Some(said) if said == format!("{LOADED} pack {pack:08x}") => Ok(()),
            said => bail!(
                "the kernel should have taken the pack {pack:08x}, and says '{}'",
                said.unwrap_or_default()
            ),
        }
    }

    /// What the kernel has said of its ramdisk's pack: that it was taken, or why it was refused.
    pub fn said_of_pack(&self) -> Option<&str> {
        self.seen.pack.as_deref()
    }

    /// QEMU's process.
    pub fn process(&self) -> u32 {
        self.process.as_raw_nonzero().get().unsigned_abs()
    }

    /// Waits until the running show's first picture is on the screen.
    ///
    /// # Errors
    /// A [`Failure`].
    pub fn wait_until_running(&mut self) -> anyhow::Result<()> {
        let mut patience = Patience::new(self.process, self.limits.answer);
        while self.lines.pop_front().is_none_or(|line| line != RUNNING) {
            if self.lines.is_empty() && !self.pump_or_wait(&mut patience)? {
                return Err(self.fail(Verdict::Hang {
                    waited_for: "the first picture".into(),
                }));
            }
        }
        Ok(())
    }

    /// Lets the show run for a while.
    ///
    /// # Errors
    /// A [`Failure`], if it ends meanwhile.
    pub fn rest(&mut self, time: Duration) -> anyhow::Result<()> {
        let by = Instant::now() + time;
        while self.pump(by)? {}
        Ok(())
    }

    /// Sends bytes as they are.
    ///
    /// # Errors
    /// When the serial line is gone; what ended it is the better error, so that is looked for.
    pub fn send_raw(&mut self, bytes: &[u8]) -> anyhow::Result<()> {
        if let Err(error) = self.serial.write_all(bytes) {
            self.pump(Instant::now() + self.limits.answer)?;
            return Err(error).context("the serial line does not take what is sent");
        }
        Ok(())
    }

    /// Sends text as a line with its checksum.
    ///
    /// # Errors
    /// As [`Machine::send_raw`].
    pub fn send_line(&mut self, text: &str) -> anyhow::Result<()> {
        let mut framed = Vec::new();
        link::write_line(format_args!("{text}"), |bytes| {
            framed.extend_from_slice(bytes)
        });
        self.send_raw(&framed)
    }

    /// The lines of the next answer, up to the one that closes it. `asked` names it in errors.
    ///
    /// # Errors
    /// A [`Failure`]; a hang if no answer comes in time.
    pub fn answer(&mut self, asked: &str) -> anyhow::Result<Vec<String>> {
        let mut patience = Patience::new(self.process, self.limits.answer);
        let mut answer = Vec::new();
        loop {
            while let Some(line) = self.lines.pop_front() {
                let closes = [OK, ERROR].contains(&first_word(&line));
                // Said on its own, between answers.
                if line != RUNNING {
                    answer.push(line);
                }
                if closes {
                    return Ok(answer);
                }
            }
            if !self.pump_or_wait(&mut patience)? {
                return Err(self.fail(Verdict::Hang {
                    waited_for: format!("the answer to '{asked}'"),
                }));
            }
        }
    }

    /// Switches a trace event of QEMU's on or off; where the events go is for QEMU's arguments.
    ///
    /// # Errors
    /// A [`Failure`], or what QEMU says.
    pub fn trace(&mut self, event: &str, on: bool) -> anyhow::Result<()> {
        let arguments = json!({ "name": event, "enable": on });
        let answer = self.control("trace-event-set-state", arguments)?;
        match answer.get("error") {
            Some(error) => Err(anyhow!("QEMU does not trace '{event}': {error}")),
            None => Ok(()),
        }
    }

    /// Pushes a key down or lets it go, by QEMU's name for it: `left`, `m`, `kp_add`.
    ///
    /// # Errors
    /// A [`Failure`], or what QEMU says.
    pub fn key(&mut self, name: &str, down: bool) -> anyhow::Result<()> {
        let key = json!({ "down": down, "key": { "type": "qcode", "data": name } });
        let events = json!({ "events": [{ "type": "key", "data": key }] });
        let answer = self.control("input-send-event", events)?;
        match answer.get("error") {
            Some(error) => Err(anyhow!("QEMU does not send the key '{name}': {error}")),
            None => Ok(()),
        }
    }

    /// Asks the kernel to leave, and waits until QEMU has ended by it.
    ///
    /// # Errors
    /// A [`Failure`] for any other end.
    pub fn leave(mut self) -> anyhow::Result<()> {
        self.seen.leaving = true;
        self.send_line(&Command::Leave.to_string())?;
        self.run_to_the_end()
    }

    /// Lets the show run until the user ends it or it fails, and asks now and then whether the
    /// kernel still lives. Always a [`Failure`] in the end: closing the window is one, by name.
    ///
    /// # Errors
    /// The [`Failure`].
    pub fn watch(mut self) -> anyhow::Result<()> {
        loop {
            self.rest(HEARTBEAT)?;
            self.lines.clear();
            if !self.seen.paused {
                self.ask(Command::Counts)?;
            }
        }
    }

    /// Waits until QEMU ends, whatever ends it.
    ///
    /// # Errors
    /// A [`Failure`], unless the kernel left as it was asked to.
    pub fn wait_for_end(mut self) -> anyhow::Result<()> {
        self.run_to_the_end()
    }

    fn run_to_the_end(&mut self) -> anyhow::Result<()> {
        let mut patience = Patience::new(self.process, self.limits.answer);
        loop {
            match self.pump_or_wait(&mut patience) {
                Ok(true) => {}
                Ok(false) => {
                    return Err(self.fail(Verdict::Hang {
                        waited_for: "QEMU's end".into(),
                    }));
                }
                Err(error) if error.downcast_ref() == Some(&Left) => return Ok(()),
                Err(error) => return Err(error),
            }
        }
    }

    /// The host's words to QEMU: `execute` with `arguments`, and QEMU's answer.
    fn control(&mut self, execute: &str, arguments: Value) -> anyhow::Result<Value> {
        if let Err(error) = qmp::send(&mut self.control, execute, arguments) {
            self.pump(Instant::now() + self.limits.answer)?;
            return Err(error).context("QEMU's control socket is closed");
        }
        let mut patience = Patience::new(self.process, self.limits.answer);
        loop {
            if let Some(answer) = self.answers.pop_front() {
                return Ok(answer);
            }
            if !self.pump_or_wait(&mut patience)? {
                self.seen
                    .words
                    .push(format!("(it does not answer '{execute}')"));
                return Err(self.judge());
            }
        }
    }

    /// QMP's greeting, and the machine's start: QEMU waits with `-S` until no event can be missed.
    fn negotiate(&mut self) -> anyhow::Result<()> {
        self.control("qmp_capabilities", json!({}))?;
        self.control("cont", json!({}))?;
        Ok(())
    }

    /// Takes in one event. False when `patience` is over before there was one; it does not run out
    /// while the user has paused the machine, as QEMU's window can.
    fn pump_or_wait(&mut self, patience: &mut Patience) -> anyhow::Result<bool> {
        while !self.pump(Instant::now() + LOOK_UP)? {
            if self.seen.paused {
                patience.renew();
            } else if patience.is_over() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Takes in one event. True if there was one before `by`.
    ///
    /// # Errors
    /// A [`Failure`] as soon as one is certain.
    fn pump(&mut self, by: Instant) -> anyhow::Result<bool> {
        let event = loop {
            if child::interrupted() {
                return Err(child::Interrupted.into());
            }
            let wait = by.saturating_duration_since(Instant::now()).min(LOOK_UP);
            match self.events.recv_timeout(wait) {
                Ok(event) => break event,
                Err(RecvTimeoutError::Timeout) if Instant::now() >= by => return Ok(false),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Err(self.judge()),
            }
        };
        match event {
            Event::Line(line) => self.take_line(line)?,
            Event::Garbled(why) => return Err(self.fail(Verdict::Garbled { why })),
            Event::Control(value) => self.take_control(value)?,
            event => self.seen.note(event),
        }
        // What the kernel said last may still be on its way when QEMU has ended.
        if self.seen.ended.is_some() && self.seen.serial_closed {
            return Err(self.judge());
        }
        Ok(true)
    }

    fn take_line(&mut self, line: String) -> anyhow::Result<()> {
        let word = first_word(&line);
        if word == HELLO {
            if self.seen.hello {
                return Err(self.fail(Verdict::TripleFault { booted: true }));
            }
            self.seen.hello = true;
            let spoken = format!("protocol {}", link::PROTOCOL);
            if !line.ends_with(&spoken) {
                return Err(anyhow!(
                    "the kernel says '{line}'; this program speaks {spoken}"
                ));
            }
        } else if [LOADED, REFUSED].contains(&word) {
            self.seen.pack = Some(line);
        } else if [PANIC, EXCEPTION, ADAPTER].contains(&word) || !self.seen.report.is_empty() {
            let whole = line == END_OF_REPORT;
            self.seen.report.push(line);
            if whole {
                self.keep_screen();
                // The kernel waits for this byte before it ends QEMU.
                let _ = self.serial.write_all(&[link::ACKNOWLEDGE]);
            }
        } else {
            self.lines.push_back(line);
        }
        Ok(())
    }

    fn take_control(&mut self, value: Value) -> anyhow::Result<()> {
        match value.get("event").and_then(Value::as_str) {
            None if value.get("QMP").is_some() => {}
            None => self.answers.push_back(value),
            Some("SHUTDOWN") => {
                // The first reason counts: `quit` below is followed by a reason of its own.
                let first = self.seen.shutdown.is_none();
                let reason = value["data"]["reason"].as_str().unwrap_or("unknown");
                let reason = self.seen.shutdown.get_or_insert(reason.to_string());
                match reason.as_str() {
                    // After a reset QEMU stands still.
                    "guest-reset" => return Err(self.judge()),
                    // `isa-debug-exit` ends QEMU 7.2 at once. QEMU 10 and later request a shutdown
                    // in place of that, and `-no-shutdown` makes QEMU stand still. `quit` ends such
                    // a QEMU with the exit code that the kernel wrote.
                    "guest-shutdown" if first => {
                        let _ = qmp::send(&mut self.control, "quit", json!({}));
                    }
                    // For the other reasons QEMU ends without a command.
                    _ => {}
                }
            }
            // After a shutdown the machine stands still because it is off: nobody paused it.
            Some("STOP") => self.seen.paused = self.seen.shutdown.is_none(),
            Some("RESUME") => self.seen.paused = false,
            Some(_) => {}
        }
        Ok(())
    }

    /// The failure that an end, or a reset, amounts to.
    fn judge(&mut self) -> anyhow::Error {
        let seen = &mut self.seen;
        let exit = seen
            .ended
            .and_then(|status| status.code())
            .and_then(Exit::from_code);
        let verdict = match (exit, seen.shutdown.as_deref()) {
            (Some(Exit::Left), _) if seen.leaving => return Left.into(),
            (Some(Exit::Panic), _) => Verdict::Panic {
                report: std::mem::take(&mut seen.report),
            },
            (Some(Exit::Exception), _) => Verdict::Exception {
                report: std::mem::take(&mut seen.report),
            },
            (Some(Exit::Adapter), _) => Verdict::Adapter {
                report: std::mem::take(&mut seen.report),
            },
            (_, Some("guest-reset")) if seen.hello => Verdict::TripleFault { booted: false },
            (_, Some("guest-reset")) => Verdict::BootLoader { reset: true },
            // SDL's window says host-ui when it is closed, GTK's quits as QMP would. This program
            // sends `quit` only after a shutdown with another reason.
            (_, Some("host-ui" | "host-qmp-quit" | "host-signal")) => Verdict::User,
            _ => Verdict::Qemu {
                words: std::mem::take(&mut seen.words),
                status: seen.ended,
            },
        };
        self.fail(verdict)
    }

    /// Ends QEMU and makes an error of the verdict, the evidence kept.
    fn fail(&mut self, verdict: Verdict) -> anyhow::Error {
        if verdict == Verdict::User {
            return Failure::plain(verdict).into();
        }
        if self.seen.ended.is_none() {
            self.keep_screen();
        }
        self.end();
        Failure::keep(verdict, self.folder.path(), &self.failures).into()
    }

    /// Takes a last screendump, if QEMU still can. Whatever else happens meanwhile is too late to
    /// change the verdict.
    fn keep_screen(&mut self) {
        let file = self.folder.path().join("screen.ppm");
        let sent = qmp::send(&mut self.control, "screendump", json!({ "filename": file }));
        let by = Instant::now() + self.limits.answer;
        while sent.is_ok()
            && let Ok(event) = self
                .events
                .recv_timeout(by.saturating_duration_since(Instant::now()))
        {
            let answered = matches!(&event, Event::Control(value) if value.get("event").is_none());
            self.seen.note(event);
            if answered || self.seen.ended.is_some() {
                break;
            }
        }
        // Evidence that can't be kept must not hide the failure that it is about.
        let _ = std::fs::read(&file)
            .map_err(anyhow::Error::from)
            .and_then(|bytes| Screen::from_ppm(&bytes))
            .and_then(|screen| {
                screen.write_png(File::create(self.folder.path().join("screen.png"))?)
            });
    }

    /// Kills QEMU, if it has not ended, and waits until it has.
    fn end(&mut self) {
        while self.seen.ended.is_none() {
            // QEMU, and all of it where --qemu names a script that starts one.
            let _ = kill_process_group(self.process, Signal::KILL);
            match self.events.recv_timeout(self.limits.answer) {
                Ok(event) => self.seen.note(event),
                Err(_) => return,
            }
        }
    }
}

impl Card for Machine {
    /// Sends the command, and waits for the answer. Errors are a [`Failure`], or the kernel's
    /// `error`.
    fn ask(&mut self, command: Command) -> anyhow::Result<Vec<String>> {
        self.send_line(&command.to_string())?;
        let mut answer = self.answer(&command.to_string())?;
        match answer.pop() {
            Some(last) if last == format!("{OK} {command}") => Ok(answer),
            last => {
                let last = last.unwrap_or_default();
                Err(anyhow!("the kernel answered '{command}' with '{last}'"))
            }
        }
    }

    /// A dump that is not in order is a line that is garbled in a way that no single line shows.
    fn dump(&mut self, content: Content) -> anyhow::Result<Dump> {
        let lines = self.ask(Command::Dump(content))?;
        Dump::from_lines(&lines).map_err(|error| {
            let why = format!("its dump is wrong in {error}");
            self.fail(Verdict::Garbled { why })
        })
    }

    /// By QEMU's `screendump`.
    fn screen(&mut self) -> anyhow::Result<Screen> {
        let file = self.folder.path().join("screen.ppm");
        let answer = self.control("screendump", json!({ "filename": file }))?;
        if let Some(error) = answer.get("error") {
            return Err(anyhow!("QEMU takes no screendump: {error}"));
        }
        let bytes = std::fs::read(&file).context("QEMU wrote no screendump")?;
        Screen::from_ppm(&bytes).context("QEMU's screendump is no picture")
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        self.end();
    }
}

impl Seen {
    /// Notes what an event says about QEMU itself.
    fn note(&mut self, event: Event) {
        match event {
            Event::Words(line) => self.words.push(line),
            Event::Ended(Ok(status)) => self.ended = Some(status),
            Event::Ended(Err(error)) => self.words.push(error.to_string()),
            Event::SerialClosed => self.serial_closed = true,
            Event::Line(_) | Event::Garbled(_) | Event::Control(_) => {}
        }
    }
}

/// Not an error: the kernel left because it was asked to.
#[derive(Debug, PartialEq, Eq)]
struct Left;

impl std::fmt::Display for Left {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the kernel has left")
    }
}

impl std::error::Error for Left {}

fn first_word(line: &str) -> &str {
    line.split(' ').next().unwrap_or("")
}

fn command_line(config: &Config, folder: &Path) -> std::process::Command {
    // A comma in a path would end the option; QEMU reads two as one.
    let path = |path: &Path| path.to_string_lossy().replace(',', ",,");
    let mut qemu = child::command(&config.qemu);
    qemu.args([
        "-name",
        "Crystal Ball",
        "-accel",
        "tcg",
        "-net",
        "none",
        "-S",
    ]);
    qemu.args(["-vga", &config.vga, "-display", &config.display]);
    // snapshot=on: writes go elsewhere, so a second QEMU is not stopped by the image's lock.
    // if=virtio: the BIOS reads an IDE disk through a port, and waits for a thread of QEMU at every
    // few sectors. A boot then takes twice the time alone, and ten times on a busy machine.
    let drive = format!(
        "if=virtio,format=raw,snapshot=on,file={}",
        path(&config.image)
    );
    qemu.args(["-drive", &drive]);
    for (id, socket) in [("qmp", "qmp"), ("com1", "serial")] {
        let socket = format!("socket,id={id},path={}", path(&folder.join(socket)));
        qemu.args(["-chardev", &socket]);
    }
    qemu.args([
        "-mon",
        "chardev=qmp,mode=control",
        "-serial",
        "chardev:com1",
    ]);
    let exit = format!("isa-debug-exit,iobase={:#x},iosize=4", Exit::PORT);
    qemu.args(["-device", &exit, "-no-reboot", "-no-shutdown"]);
    qemu.args(&config.arguments);
    qemu
}

/// Starts QEMU on a thread that lives as long as it: the signal that ends QEMU with this program
/// is tied to the thread that started it.
fn start(mut command: std::process::Command, send: Sender<Event>) -> anyhow::Result<Pid> {
    // A process group of its own: Ctrl-C is for this program, which then ends QEMU.
    command
        .process_group(0)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    let (started, wait) = mpsc::channel();
    thread::spawn(move || {
        let mut child = match command.spawn() {
            Ok(child) => child,
            Err(error) => {
                let _ = started.send(Err(error));
                return;
            }
        };
        let _ = started.send(Ok(Pid::from_child(&child)));
        if let Some(words) = child.stderr.take() {
            for line in BufReader::new(words).lines().map_while(Result::ok) {
                let _ = send.send(Event::Words(line));
            }
        }
        let _ = send.send(Event::Ended(child.wait()));
    });
    let started = wait.recv().context("the thread that starts QEMU is gone")?;
    started.context("QEMU cannot be started")
}

fn listen(path: &Path) -> anyhow::Result<UnixListener> {
    let listener =
        UnixListener::bind(path).with_context(|| format!("no socket at {}", path.display()))?;
    listener.set_nonblocking(true)?;
    Ok(listener)
}

/// Waits for QEMU to connect, or to end.
fn accept(
    listener: &UnixListener,
    process: Pid,
    limit: Duration,
    name: &str,
) -> anyhow::Result<UnixStream> {
    let mut patience = Patience::new(process, limit);
    loop {
        match listener.accept() {
            Ok((stream, _)) => {
                stream.set_nonblocking(false)?;
                return Ok(stream);
            }
            Err(error) if error.kind() != ErrorKind::WouldBlock => return Err(error.into()),
            Err(_) if child::interrupted() => return Err(child::Interrupted.into()),
            Err(_) if test_kill_process(process).is_err() => {
                bail!("it ended before it opened {name}")
            }
            Err(_) if patience.is_over() => bail!("it never opened {name}"),
            Err(_) => thread::sleep(Duration::from_millis(2)),
        }
    }
}

/// What a QEMU amounts to that did not come as far as its sockets.
fn never_connected(
    error: anyhow::Error,
    process: Pid,
    events: &Receiver<Event>,
    folder: &TempDir,
    config: &Config,
) -> anyhow::Error {
    let _ = kill_process_group(process, Signal::KILL);
    let mut seen = Seen::default();
    while seen.ended.is_none()
        && let Ok(event) = events.recv_timeout(config.limits.answer)
    {
        seen.note(event);
    }
    if error.is::<child::Interrupted>() {
        return error;
    }
    if seen.words.is_empty() {
        seen.words.push(error.to_string());
    }
    let verdict = Verdict::Qemu {
        words: seen.words,
        status: seen.ended,
    };
    Failure::keep(verdict, folder.path(), &config.failures).into()
}

fn read_control(stream: UnixStream, send: Sender<Event>) {
    thread::spawn(move || {
        for line in BufReader::new(stream).lines().map_while(Result::ok) {
            if let Ok(value) = serde_json::from_str(&line) {
                let _ = send.send(Event::Control(value));
            }
        }
    });
}

/// Reads the serial line into its log and into lines.
///
/// Before the kernel's first line the firmware may have said anything; after it, every line has
/// its checksum.
fn read_serial(mut stream: UnixStream, folder: &Path, send: Sender<Event>) -> anyhow::Result<()> {
    let mut log = File::create(folder.join("serial.log")).context("no log of the serial line")?;
    thread::spawn(move || {
        let (mut lines, mut greeted) = (Lines::new(), false);
        let mut bytes = [0; 4096];
        while let Ok(len @ 1..) = stream.read(&mut bytes) {
            let bytes = &bytes[..len];
            // A full disk costs the log, not the run.
            let _ = log.write_all(bytes);
            for &byte in bytes {
                let Some(line) = lines.push(byte) else {
                    continue;
                };
                let text = line.map_err(|noise| noise.to_string()).and_then(|line| {
                    link::unframe(line).map_err(|error| format!("{error}: '{line}'"))
                });
                greeted |= text.is_ok();
                let event = match text {
                    Ok(text) => Event::Line(text.to_string()),
                    Err(_) if !greeted => continue,
                    Err(why) => Event::Garbled(why),
                };
                let _ = send.send(event);
            }
        }
        let _ = send.send(Event::SerialClosed);
    });
    Ok(())
}
