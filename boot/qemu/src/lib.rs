//! Boots the image in QEMU, talks to the kernel, and judges how the run ended.
//!
//! The verdict is made on the host, so that a crash of the kernel is a result with a name. It has three
//! sources:
//!
//! - the serial line: the kernel's lines, and its report when it fails;
//! - QMP, QEMU's control socket: the reason of the `SHUTDOWN` event;
//! - the code that the kernel wrote to `isa-debug-exit`.
//!
//! QEMU's exit code 0 is not a source, because a triple fault, a closed window and a signal that ends QEMU
//! all give this code.
//!
//! The command line of a configuration needs no boot:
//!
//! ```
//! use setup::{Qemu, Ready};
//!
//! let qemu = Qemu {
//!     path: "qemu-system-x86_64".into(),
//!     version: "7.2.0".into(),
//!     displays: vec!["none".into()],
//! };
//! let ready = Ready { image: "demo.img".into(), kernel: "kernel".into(), qemu };
//! let line = qemu::Config::new(&ready).command_line();
//! assert!(line.starts_with("qemu-system-x86_64 -name 'Crystal Ball' -net none"));
//! assert!(line.contains("file=demo.img"));
//! ```
//!
//! QEMU runs with `-no-reboot -no-shutdown`: after a reset it keeps the machine stopped and does not exit, so
//! a last screendump can be taken. Threads only read (the serial line, QMP, QEMU's output, its exit status)
//! and feed one channel. The caller's thread makes every decision.

mod command;
mod config;
mod option;
mod qmp;
mod run;
mod verdict;
mod watchdog;

use std::ffi::OsString;
use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::os::fd::AsRawFd;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow, bail};
use protocol::{Command, Content, ERROR, LOADED, Lines, OK, RUNNING};
use rustix::fs::MemfdFlags;
use rustix::process::{Pid, Signal, kill_process_group};
use serde_json::{Value, json};

pub use config::{Config, Limits};
use qmp::Control;
use run::{Reaction, RunState, VmEvent};
use verdict::Evidence;
pub use verdict::{BootDiagnosis, Failure, Verdict};
use watchdog::Watchdog;

use frames::backend::Backend;
use frames::dump::Dump;
use frames::rgb::RgbImage;
use system::quote::quoted;
use system::{Interrupted, interrupted};

/// How often [`Vm::watch`] checks that the running demo still answers.
const HEARTBEAT: Duration = Duration::from_secs(5);
/// Longest wait between two checks for Ctrl-C.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// A virtual machine: a QEMU that runs the image. Dropping it ends QEMU.
///
/// Nothing remains in the file system, however this program ends: QEMU inherits its sockets, and the log and
/// the screendumps are files without a name.
#[derive(Debug)]
pub struct Vm {
    events: Receiver<VmEvent>,
    serial: UnixStream,
    control: Control,
    process: Pid,
    arguments: Vec<OsString>,
    evidence: Evidence,
    failures: PathBuf,
    limits: Limits,
    /// The watchdog for QEMU's end, once the machine is off.
    ending: Option<Watchdog>,
    run: RunState,
}

/// The list that QEMU printed instead of starting a machine, because its arguments requested the list
/// (`-machine help`).
///
/// `Printed` is an error type, so that it ends the caller's work, but it is not a [`Failure`].
#[derive(Debug)]
pub struct Printed(pub String);

impl std::fmt::Display for Printed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0.trim_end())
    }
}

impl std::error::Error for Printed {}

impl Vm {
    /// Starts QEMU and waits for the kernel's first line.
    ///
    /// # Errors
    /// A [`Failure`] with the verdict; [`Printed`] if QEMU's arguments only requested a list; the reason if
    /// QEMU could not be started.
    pub fn boot(config: &Config) -> anyhow::Result<Self> {
        Self::boot_through(config, |serial| serial)
    }

    /// Starts QEMU like [`Vm::boot`], with an intermediary on the serial line: `tap` receives QEMU's end
    /// of the line and returns the stream to use in its place.
    ///
    /// # Errors
    /// As [`Vm::boot`].
    pub fn boot_through(
        config: &Config,
        tap: impl FnOnce(UnixStream) -> UnixStream,
    ) -> anyhow::Result<Self> {
        let daemonize =
            |word: &OsString| word.to_str().and_then(option::option) == Some("daemonize");
        if config.arguments.iter().any(daemonize) {
            bail!(
                "-daemonize: not supported, because this program could not end such a QEMU; leave the option out"
            );
        }
        let (send, events) = mpsc::channel();
        let arguments = command::arguments(config);
        let started = command::start(&config.qemu, &arguments, send.clone())?;
        let (control, serial) = (started.control, tap(started.serial));
        // If the other side stops reading, a write must not block the checks for Ctrl-C.
        control.set_write_timeout(Some(POLL_INTERVAL))?;
        serial.set_write_timeout(Some(POLL_INTERVAL))?;
        // On a full disk only the log is lost; the run continues.
        let log = tempfile::tempfile().ok();
        read_control(control.try_clone()?, send.clone());
        read_serial(
            serial.try_clone()?,
            log.as_ref().and_then(|log| log.try_clone().ok()),
            send,
        );
        let mut vm = Self {
            events,
            serial,
            control: Control::new(control),
            process: started.process,
            arguments: config.arguments.clone(),
            evidence: Evidence {
                command: config.command_line() + "\n",
                serial: log,
                screen: None,
            },
            failures: config.failures.clone(),
            limits: config.limits,
            ending: None,
            run: RunState::default(),
        };
        vm.run.wants_list = config.arguments.iter().any(|word| word == "help");
        vm.negotiate()?;
        let mut watchdog = Watchdog::new(vm.process, config.limits.boot);
        while !vm.run.hello {
            if !vm.pump_or_wait(&mut watchdog)? {
                let reset = vm.run.was_reset();
                let diagnosis = BootDiagnosis::default();
                return Err(vm.fail(Verdict::BootLoader { reset, diagnosis }));
            }
        }
        if let Some(model_file) = config.model_file {
            vm.wait_for_model(model_file)?;
        }
        Ok(vm)
    }

    /// Waits until the kernel has accepted the model file with this checksum.
    fn wait_for_model(&mut self, model_file: u32) -> anyhow::Result<()> {
        let mut watchdog = Watchdog::new(self.process, self.limits.answer);
        while self.run.model_file.is_none() {
            if !self.pump_or_wait(&mut watchdog)? {
                return Err(self.fail(Verdict::Hang {
                    waited_for: "the kernel's line about the model file".into(),
                }));
            }
        }
        match self.model_answer() {
            Some(answer) if answer == format!("{LOADED} model {model_file:08x}") => Ok(()),
            answer => bail!(
                "model file {model_file:08x}: the kernel did not accept it and answered '{}'",
                answer.unwrap_or_default()
            ),
        }
    }

    /// Returns the kernel's line about the model file in its ramdisk: accepted, or refused with the reason.
    pub fn model_answer(&self) -> Option<&str> {
        self.run.model_file.as_deref()
    }

    /// Returns QEMU's process ID.
    pub fn process(&self) -> u32 {
        self.process.as_raw_nonzero().get().unsigned_abs()
    }

    /// Returns the total time that QEMU's threads have been ready to run without a processor. On a quiet
    /// machine it hardly grows.
    pub fn starved_time(&self) -> Duration {
        watchdog::starved_time(self.process)
    }

    /// Waits until the running demo's first frame is on the screen.
    ///
    /// # Errors
    /// A [`Failure`].
    pub fn wait_until_running(&mut self) -> anyhow::Result<()> {
        let mut watchdog = Watchdog::new(self.process, self.limits.answer);
        while self
            .run
            .lines
            .pop_front()
            .is_none_or(|line| line != RUNNING)
        {
            if self.run.lines.is_empty() && !self.pump_or_wait(&mut watchdog)? {
                return Err(self.fail(Verdict::Hang {
                    waited_for: "the first frame".into(),
                }));
            }
        }
        Ok(())
    }

    /// Changes the limits of all later waits.
    pub fn set_limits(&mut self, limits: Limits) {
        self.limits = limits;
    }

    /// Lets the demo run for `time`.
    ///
    /// # Errors
    /// A [`Failure`] if the run ends within that time.
    pub fn rest(&mut self, time: Duration) -> anyhow::Result<()> {
        let by = Instant::now() + time;
        while Instant::now() < by {
            self.pump(by)?;
        }
        Ok(())
    }

    /// Sends bytes unchanged, without a checksum.
    ///
    /// # Errors
    /// A [`Failure`]; a hang if the kernel does not read for too long.
    pub fn send_raw(&mut self, mut bytes: &[u8]) -> anyhow::Result<()> {
        let mut watchdog = Watchdog::new(self.process, self.limits.answer);
        while !bytes.is_empty() {
            match self.serial.write(bytes) {
                Ok(count) => {
                    bytes = &bytes[count..];
                    watchdog.renew();
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    self.pump(Instant::now())?;
                    if self.is_over(&mut watchdog) {
                        return Err(self.fail(Verdict::Hang {
                            waited_for: "room in the kernel's serial buffer".into(),
                        }));
                    }
                }
                Err(error) => {
                    // If QEMU has ended, the reason of its end is the better error.
                    self.rest(self.limits.answer)?;
                    return Err(error).context("the serial line is closed");
                }
            }
        }
        Ok(())
    }

    /// Sends text as a line with its checksum.
    ///
    /// # Errors
    /// As [`Vm::send_raw`].
    pub fn send_line(&mut self, text: &str) -> anyhow::Result<()> {
        let mut framed = Vec::new();
        protocol::write_line(format_args!("{text}"), |bytes| {
            framed.extend_from_slice(bytes)
        });
        self.send_raw(&framed)
    }

    /// Returns the lines of the next answer, including the closing line. `request` names the answer in
    /// errors.
    ///
    /// # Errors
    /// A [`Failure`]; a hang if no answer comes in time.
    pub fn answer(&mut self, request: &str) -> anyhow::Result<Vec<String>> {
        let mut watchdog = Watchdog::new(self.process, self.limits.answer);
        let mut answer = Vec::new();
        loop {
            while let Some(line) = self.run.lines.pop_front() {
                let closes = [OK, ERROR].contains(&first_word(&line));
                // The kernel sends this line between answers, not as part of an answer.
                if line != RUNNING {
                    answer.push(line);
                }
                if closes {
                    return Ok(answer);
                }
            }
            if !self.pump_or_wait(&mut watchdog)? {
                return Err(self.fail(Verdict::Hang {
                    waited_for: format!("the answer to '{request}'"),
                }));
            }
        }
    }

    /// Switches one of QEMU's trace events on or off. QEMU's arguments decide where the trace goes.
    ///
    /// # Errors
    /// A [`Failure`], or QEMU's error.
    pub fn trace(&mut self, event: &str, on: bool) -> anyhow::Result<()> {
        let arguments = json!({ "name": event, "enable": on });
        let answer = self.control("trace-event-set-state", arguments)?;
        match answer.get("error") {
            Some(error) => Err(anyhow!("trace event '{event}': QEMU refused it: {error}")),
            None => Ok(()),
        }
    }

    /// Presses or releases a key. `name` is QEMU's name for the key: `left`, `m`, `kp_add`.
    ///
    /// # Errors
    /// A [`Failure`], or QEMU's error.
    pub fn key(&mut self, name: &str, down: bool) -> anyhow::Result<()> {
        let key = json!({ "down": down, "key": { "type": "qcode", "data": name } });
        let events = json!({ "events": [{ "type": "key", "data": key }] });
        let answer = self.control("input-send-event", events)?;
        match answer.get("error") {
            Some(error) => Err(anyhow!("key '{name}': QEMU refused it: {error}")),
            None => Ok(()),
        }
    }

    /// Sends the kernel `leave`, and waits until QEMU has ended because of it.
    ///
    /// # Errors
    /// A [`Failure`] for any other end.
    pub fn leave(mut self) -> anyhow::Result<()> {
        self.run.leaving = true;
        self.send_line(&Command::Leave.to_string())?;
        self.run_to_the_end()
    }

    /// Lets the demo run until the user ends it or it fails.
    ///
    /// Every few seconds the kernel must answer a command; while the user has paused the machine, QEMU must
    /// answer instead. The result is always an error: a closed window is the [`Failure`] with
    /// [`Verdict::User`].
    ///
    /// # Errors
    /// The [`Failure`].
    pub fn watch(mut self) -> anyhow::Result<()> {
        loop {
            self.rest(HEARTBEAT)?;
            self.run.lines.clear();
            if self.run.paused.is_some() {
                self.control("query-status", json!({}))?;
            } else {
                self.send(Command::Counts)?;
            }
        }
    }

    /// Waits until QEMU ends for any reason.
    ///
    /// # Errors
    /// A [`Failure`], unless the kernel left on command.
    pub fn wait_for_end(mut self) -> anyhow::Result<()> {
        self.run_to_the_end()
    }

    fn run_to_the_end(&mut self) -> anyhow::Result<()> {
        let mut watchdog = Watchdog::new(self.process, self.limits.answer);
        loop {
            match self.pump_or_wait(&mut watchdog) {
                Ok(true) => {}
                Ok(false) => {
                    return Err(self.fail(Verdict::Hang {
                        waited_for: "QEMU's end".into(),
                    }));
                }
                Err(error) if error.downcast_ref() == Some(&KernelLeft) => return Ok(()),
                Err(error) => return Err(error),
            }
        }
    }

    /// Sends `execute` with `arguments` to QEMU, and returns QEMU's reply.
    fn control(&mut self, execute: &str, arguments: Value) -> anyhow::Result<Value> {
        let id = match self.control.send(execute, arguments) {
            Ok(id) => id,
            Err(error) => {
                // If QEMU has ended, the reason of its end is the better error.
                self.rest(self.limits.answer)?;
                return Err(error).context("QEMU's control socket is closed");
            }
        };
        let mut watchdog = Watchdog::new(self.process, self.limits.answer);
        loop {
            while let Some(reply) = self.run.replies.pop_front() {
                if qmp::is_reply(&reply, id) {
                    return Ok(reply);
                }
            }
            if !self.pump_or_wait(&mut watchdog)? {
                let mut output = self.run.output.clone();
                output.push(format!("(QEMU does not answer '{execute}')"));
                let status = self.run.ended;
                return Err(self.fail(Verdict::Qemu { output, status }));
            }
        }
    }

    /// Completes QMP's greeting and starts the machine. QEMU was started with `-S`, so the machine has waited
    /// until no event could be missed.
    fn negotiate(&mut self) -> anyhow::Result<()> {
        self.control("qmp_capabilities", json!({}))?;
        self.control("cont", json!({}))?;
        self.run.started = true;
        Ok(())
    }

    /// Handles one event and returns true.
    ///
    /// Returns false if `watchdog` is over before an event comes, or if events keep coming beyond the
    /// watchdog's ceiling.
    fn pump_or_wait(&mut self, watchdog: &mut Watchdog) -> anyhow::Result<bool> {
        while !self.pump(Instant::now() + POLL_INTERVAL)? {
            if self.is_over(watchdog) {
                return Ok(false);
            }
        }
        Ok(!watchdog.is_past_ceiling())
    }

    /// Returns whether `watchdog` is over. A pause, which a user can start from QEMU's window, renews the
    /// watchdog and has a separate limit.
    fn is_over(&self, watchdog: &mut Watchdog) -> bool {
        match self.run.paused {
            Some(since) => {
                watchdog.renew();
                since.elapsed() >= self.limits.pause
            }
            None => watchdog.is_over(),
        }
    }

    /// Handles one event. Returns whether an event came before `by`.
    ///
    /// # Errors
    /// A [`Failure`] as soon as one is certain.
    fn pump(&mut self, by: Instant) -> anyhow::Result<bool> {
        let event = loop {
            if interrupted() {
                return Err(Interrupted.into());
            }
            if self.ending.as_mut().is_some_and(Watchdog::is_over) {
                self.end();
            }
            if self.run.is_decided() {
                return Err(self.judge());
            }
            let wait = by
                .saturating_duration_since(Instant::now())
                .min(POLL_INTERVAL);
            match self.events.recv_timeout(wait) {
                Ok(event) => break event,
                Err(RecvTimeoutError::Timeout) if Instant::now() >= by => return Ok(false),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Err(self.judge()),
            }
        };
        self.handle(event);
        if self.run.is_decided() {
            return Err(self.judge());
        }
        Ok(true)
    }

    /// Handles an event and carries out the action that follows from it.
    fn handle(&mut self, event: VmEvent) {
        // If a write fails, QEMU is ending, and the next event is its end.
        match self.run.handle(event) {
            Some(Reaction::Quit) => {
                let _ = self.control.send("quit", json!({}));
                self.ending = Some(Watchdog::new(self.process, self.limits.answer));
            }
            Some(Reaction::QueryStatus) => {
                let _ = self.control.send("query-status", json!({}));
            }
            Some(Reaction::Acknowledge) => {
                self.keep_screen();
                // The kernel waits for this byte before it ends QEMU.
                let _ = self.serial.write_all(&[protocol::ACKNOWLEDGE]);
            }
            None => {}
        }
    }

    /// Returns the error for a run that has ended or was reset.
    fn judge(&mut self) -> anyhow::Error {
        if let Some(text) = self.run.printed() {
            return Printed(text).into();
        }
        match self.run.verdict() {
            Ok(()) => KernelLeft.into(),
            Err(verdict) => self.fail(verdict),
        }
    }

    /// Ends QEMU, keeps the evidence, and returns the verdict as an error.
    fn fail(&mut self, mut verdict: Verdict) -> anyhow::Error {
        if verdict == Verdict::User {
            return Failure::plain(verdict).into();
        }
        if let Verdict::BootLoader { diagnosis, .. } = &mut verdict {
            *diagnosis = self.examine();
        }
        if self.run.ended.is_none() {
            self.keep_screen();
        }
        self.end();
        Failure::keep(verdict, &self.evidence, &self.failures).into()
    }

    /// Queries QEMU for the memory, the CPU and the text screen. A field without an answer stays empty.
    fn examine(&mut self) -> BootDiagnosis {
        let memory = self.request("query-memory-size-summary", json!({}));
        let cpus = self.request("query-cpus-fast", json!({}));
        let cpu = cpus.and_then(|cpus| Some(cpus[0]["qom-path"].as_str()?.to_string()));
        let long_mode = cpu.and_then(|path| {
            self.request("qom-get", json!({ "path": path, "property": "lm" }))?
                .as_bool()
        });
        // 25 lines of 80 characters in the colour adapter's memory.
        let text = json!({ "val": 0xB_8000, "size": 2 * 80 * 25 });
        let text = self.request_file("pmemsave", text).unwrap_or_default();
        BootDiagnosis {
            memory: memory.and_then(|memory| memory["base-memory"].as_u64()),
            long_mode,
            arguments: self.arguments.clone(),
            screen: verdict::text_lines(&text),
        }
    }

    /// Sends a command to QEMU and returns the reply, or `None` if QEMU ends or does not answer in time.
    ///
    /// Other events are processed meanwhile and cannot fail this call: it collects evidence for a verdict
    /// that is already certain.
    fn request(&mut self, execute: &str, arguments: Value) -> Option<Value> {
        let id = self.control.send(execute, arguments).ok()?;
        let by = Instant::now() + self.limits.answer;
        while self.run.ended.is_none() {
            let wait = by.saturating_duration_since(Instant::now());
            match self.events.recv_timeout(wait).ok()? {
                VmEvent::Control(mut reply) if qmp::is_reply(&reply, id) => {
                    return reply.get_mut("return").map(Value::take);
                }
                event => self.handle(event),
            }
        }
        None
    }

    /// Sends a command that writes a file, as [`Vm::request`] does, and returns the file's bytes.
    fn request_file(&mut self, execute: &str, mut arguments: Value) -> Option<Vec<u8>> {
        let mut file = UnnamedFile::new().ok()?;
        arguments["filename"] = file.path().into();
        self.request(execute, arguments)?;
        file.bytes().ok()
    }

    /// Takes a last screendump if QEMU still can, and keeps it unless one was kept before.
    fn keep_screen(&mut self) {
        let bytes = self.request_file("screendump", json!({}));
        let screen = bytes.and_then(|bytes| RgbImage::from_ppm(&bytes).ok());
        // The first screendump, taken when the kernel's report came, is the useful one.
        if self.evidence.screen.is_none() {
            self.evidence.screen = screen;
        }
    }

    /// Kills QEMU if it has not ended, and waits for its end.
    fn end(&mut self) {
        while self.run.ended.is_none() {
            // The whole process group: `--qemu` may name a script that starts QEMU.
            let _ = kill_process_group(self.process, Signal::KILL);
            match self.events.recv_timeout(self.limits.answer) {
                Ok(event) => drop(self.run.handle(event)),
                Err(_) => return,
            }
        }
    }
}

/// A file without a name. QEMU opens it through this process's entry in `/proc`.
struct UnnamedFile(File);

impl UnnamedFile {
    fn new() -> anyhow::Result<Self> {
        let file = rustix::fs::memfd_create("crystal-ball", MemfdFlags::CLOEXEC);
        Ok(Self(file.context("no file can be made in memory")?.into()))
    }

    /// Returns a path to the file. It is valid while this process lives.
    fn path(&self) -> String {
        format!("/proc/{}/fd/{}", std::process::id(), self.0.as_raw_fd())
    }

    /// Returns the file's contents.
    fn bytes(&mut self) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.0.read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}

impl Backend for Vm {
    /// Sends the command and waits for the answer. An error is a [`Failure`], or the kernel's `error` line.
    fn send(&mut self, command: Command) -> anyhow::Result<Vec<String>> {
        self.send_line(&command.to_string())?;
        let mut answer = self.answer(&command.to_string())?;
        match answer.pop() {
            Some(last) if last == format!("{OK} {command}") => Ok(answer),
            last => {
                let last = last.unwrap_or_default();
                Err(anyhow!("'{command}': the kernel answered '{last}'"))
            }
        }
    }

    /// Requests a dump. A malformed dump gives [`Verdict::Garbled`]: the serial line was garbled in a way
    /// that no line's checksum shows.
    fn dump(&mut self, content: Content) -> anyhow::Result<Dump> {
        let lines = self.send(Command::Dump(content))?;
        Dump::from_lines(&lines).map_err(|error| {
            let why = format!("the dump is damaged in {error}");
            self.fail(Verdict::Garbled { why })
        })
    }

    /// Returns QEMU's `screendump`.
    fn screen(&mut self) -> anyhow::Result<RgbImage> {
        let mut file = UnnamedFile::new()?;
        let reply = self.control("screendump", json!({ "filename": file.path() }))?;
        if let Some(error) = reply.get("error") {
            bail!("QEMU's screendump failed: {error}");
        }
        let bytes = file.bytes().context("QEMU's screendump cannot be read")?;
        RgbImage::from_ppm(&bytes).context("QEMU's screendump is not an image")
    }
}

impl Drop for Vm {
    fn drop(&mut self) {
        self.end();
    }
}

/// The kernel left on command. It travels as an error, but it is a success.
#[derive(Debug, PartialEq, Eq)]
struct KernelLeft;

impl std::fmt::Display for KernelLeft {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the kernel has left")
    }
}

impl std::error::Error for KernelLeft {}

fn first_word(line: &str) -> &str {
    line.split(' ').next().unwrap_or("")
}

fn read_control(stream: UnixStream, send: Sender<VmEvent>) {
    thread::spawn(move || {
        for line in BufReader::new(stream).lines().map_while(Result::ok) {
            if let Ok(value) = serde_json::from_str(&line) {
                let _ = send.send(VmEvent::Control(value));
            }
        }
        let _ = send.send(VmEvent::ControlClosed);
    });
}

/// How long bytes collect on the serial line between two reads.
///
/// QEMU sends each byte in a separate call, up to 100 000 a second. A thread that wakes for each byte keeps a
/// core busy.
const READ_INTERVAL: Duration = Duration::from_micros(250);

/// Starts a thread that copies the serial line to `log` and sends its lines as events.
///
/// Before the kernel's first valid line the firmware may print anything, so invalid lines are ignored. After
/// it, every line must have its checksum.
fn read_serial(mut stream: UnixStream, mut log: Option<File>, send: Sender<VmEvent>) {
    thread::spawn(move || {
        let (mut lines, mut greeted) = (Lines::new(), false);
        let mut bytes = [0; 4096];
        while let Ok(len @ 1..) = stream.read(&mut bytes) {
            let bytes = &bytes[..len];
            if let Some(log) = &mut log {
                let _ = log.write_all(bytes);
            }
            for &byte in bytes {
                let Some(line) = lines.push(byte) else {
                    continue;
                };
                let text = line.map_err(|noise| noise.to_string()).and_then(|line| {
                    protocol::without_checksum(line)
                        .map_err(|error| format!("{error}: {}", quoted(line)))
                });
                greeted |= text.is_ok();
                let event = match text {
                    Ok(text) => VmEvent::Line(text.to_string()),
                    Err(_) if !greeted => continue,
                    Err(why) => VmEvent::Garbled(why),
                };
                // The [`Vm`] was dropped. Without this return, a flood of lines would keep the thread busy
                // for ever.
                if send.send(event).is_err() {
                    return;
                }
            }
            thread::sleep(READ_INTERVAL);
        }
        let _ = send.send(VmEvent::SerialClosed);
    });
}
