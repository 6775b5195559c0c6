//! The state of a run, derived from its events alone, and the verdict on it.
//!
//! Nothing here waits or talks to QEMU: [`Run::take`] returns the action that the caller must carry out. A
//! test can therefore judge the recorded events of any QEMU version.

use std::collections::VecDeque;
use std::process::ExitStatus;
use std::time::Instant;

use protocol::{ADAPTER, END_OF_REPORT, EXCEPTION, Exit, HELLO, LOADED, PANIC, REFUSED};
use serde_json::Value;

use super::verdict::{Found, Verdict};

/// Run states in which QEMU itself has stopped the machine and that the user does not end. QEMU's other
/// stopped states are the user's pause, a debugger's stop, and states that pass.
const QEMU_STOPPED: [&str; 4] = ["guest-panicked", "internal-error", "io-error", "watchdog"];
/// QEMU's events that explain such a state. Their data is kept for the message.
const TELLING: [&str; 4] = [
    "BLOCK_IO_ERROR",
    "GUEST_PANICKED",
    "MEMORY_FAILURE",
    "WATCHDOG",
];

/// An event of a running QEMU.
#[derive(Debug)]
pub enum Event {
    /// A line on the serial line with a correct checksum.
    Line(String),
    /// Invalid data on the serial line, as a description of the error.
    Garbled(String),
    /// A message on the control socket.
    Control(Value),
    /// A line of QEMU's standard error, which also receives its standard output.
    Words(String),
    /// QEMU's end.
    Ended(std::io::Result<ExitStatus>),
    /// Everything on the serial line has been read.
    SerialClosed,
    /// Everything on the control socket has been read.
    ControlClosed,
}

/// The action that an event calls for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Act {
    /// Send QEMU `quit`: the machine is off, and QEMU may otherwise wait for ever.
    Quit,
    /// Send QEMU `query-status` to find out why the machine has stopped.
    AskStatus,
    /// Take the last screendump and acknowledge the kernel's report.
    Acknowledge,
}

/// The state of a run.
#[derive(Debug, Default)]
pub struct Run {
    /// The kernel's first line has come.
    pub hello: bool,
    /// The kernel's line about the model file in its ramdisk: accepted or refused.
    pub model_file: Option<String>,
    /// The user's arguments ask QEMU for a list (`-d help`).
    pub asked_for_list: bool,
    /// The machine has been started.
    pub started: bool,
    /// The kernel was sent `leave`.
    pub leaving: bool,
    /// When the user paused the machine, if it is paused.
    pub paused: Option<Instant>,
    /// The kernel's unread lines.
    pub lines: VecDeque<String>,
    /// QEMU's unread replies.
    pub replies: VecDeque<Value>,
    /// QEMU's output, and explanations from its events.
    pub words: Vec<String>,
    /// QEMU's exit status, once it has ended.
    pub ended: Option<ExitStatus>,
    /// QEMU's reason for turning the machine off. The first reason stays, because `quit` adds another reason
    /// later.
    shutdown: Option<String>,
    /// The machine was reset and continues.
    reset: bool,
    /// The lines of the kernel's report.
    report: Vec<String>,
    serial_closed: bool,
    control_closed: bool,
    /// A verdict that does not need to wait for QEMU's end.
    certain: Option<Verdict>,
}

impl Run {
    /// Updates the state with an event, and returns the action that follows from it.
    pub fn take(&mut self, event: Event) -> Option<Act> {
        match event {
            Event::Line(line) => return self.take_line(line),
            Event::Control(message) => return self.take_control(message),
            Event::Garbled(why) => self.decide(Verdict::Garbled { why }),
            Event::Words(line) => self.words.push(line),
            Event::Ended(Ok(status)) => self.ended = Some(status),
            Event::Ended(Err(error)) => self.words.push(error.to_string()),
            Event::SerialClosed => self.serial_closed = true,
            Event::ControlClosed => self.control_closed = true,
        }
        None
    }

    fn take_line(&mut self, line: String) -> Option<Act> {
        let word = line.split(' ').next().unwrap_or("");
        if word == HELLO {
            let spoken = format!("protocol {}", protocol::PROTOCOL);
            if self.hello {
                self.decide(Verdict::TripleFault { booted: true });
            } else if !line.ends_with(&spoken) {
                let why = format!("the kernel says '{line}'; this program speaks {spoken}");
                self.decide(Verdict::Garbled { why });
            }
            self.hello = true;
        } else if [LOADED, REFUSED].contains(&word) {
            self.model_file = Some(line);
        } else if [PANIC, EXCEPTION, ADAPTER].contains(&word) || !self.report.is_empty() {
            let whole = line == END_OF_REPORT;
            self.report.push(line);
            return whole.then_some(Act::Acknowledge);
        } else {
            self.lines.push_back(line);
        }
        None
    }

    fn take_control(&mut self, message: Value) -> Option<Act> {
        let Some(event) = message.get("event").and_then(Value::as_str) else {
            // QMP's greeting and its events have no `id`; only replies have one.
            if message.get("id").is_some() {
                self.take_status(&message["return"]["status"]);
                self.replies.push_back(message);
            }
            return None;
        };
        match event {
            "SHUTDOWN" => {
                self.paused = None;
                if self.shutdown.is_some() {
                    return None;
                }
                let reason = message["data"]["reason"].as_str().unwrap_or("unknown");
                self.shutdown = Some(reason.to_string());
                // With `-no-shutdown` QEMU keeps running when the machine is off, so it needs `quit`. For
                // some reasons QEMU ends despite the option, as 7.2 does for `isa-debug-exit`. From version
                // 10 on, `quit` yields the exit code that the kernel wrote to that device. A machine that has
                // reset itself gets no `quit`: it is judged while it stands still.
                return (reason != "guest-reset").then_some(Act::Quit);
            }
            // The user asked for a power-down in the window's menu or at the monitor. The kernel does not
            // notice it.
            "POWERDOWN" => return Some(Act::Quit),
            "RESET" => self.reset = true,
            // A machine that is off sends `STOP` too, but no user has paused it.
            "STOP" if self.shutdown.is_none() => {
                self.paused.get_or_insert_with(Instant::now);
                return Some(Act::AskStatus);
            }
            "RESUME" => self.paused = None,
            event if TELLING.contains(&event) => {
                self.words.push(format!("({event}: {})", message["data"]));
            }
            _ => {}
        }
        None
    }

    /// Updates the state with the machine's run state, given by QEMU's name for it.
    fn take_status(&mut self, status: &Value) {
        match status.as_str() {
            Some("running") => self.paused = None,
            Some(status) if QEMU_STOPPED.contains(&status) => {
                let mut words = self.words.clone();
                words.push(format!("(QEMU stopped the machine: '{status}')"));
                self.decide(Verdict::Qemu {
                    words,
                    status: None,
                });
            }
            _ => {}
        }
    }

    /// Keeps the verdict, unless an earlier one is certain already.
    fn decide(&mut self, verdict: Verdict) {
        self.certain.get_or_insert(verdict);
    }

    /// Returns whether the machine was reset. It may be running again.
    pub fn was_reset(&self) -> bool {
        self.reset || self.shutdown.as_deref() == Some("guest-reset")
    }

    /// Returns whether the verdict is certain. QEMU's end alone is not enough: the last words of the kernel
    /// and of QEMU may still be unread.
    pub fn is_decided(&self) -> bool {
        self.certain.is_some()
            || self.shutdown.as_deref() == Some("guest-reset")
            || (self.ended.is_some() && self.serial_closed && self.control_closed)
    }

    /// Returns QEMU's output if its arguments asked only for a list (`-machine help`): QEMU ended
    /// successfully before the machine was started. QEMU 7.2 ends `-d help` with exit code 1.
    pub fn printed(&self) -> Option<String> {
        let code = self.ended.and_then(|status| status.code());
        let well = code == Some(0) || (code == Some(1) && self.asked_for_list);
        (well && !self.started && !self.words.is_empty()).then(|| self.words.join("\n") + "\n")
    }

    /// Returns `Ok` if the kernel left on command, and otherwise the verdict.
    pub fn verdict(&mut self) -> Result<(), Verdict> {
        if let Some(verdict) = self.certain.take() {
            return Err(verdict);
        }
        let code = self.ended.and_then(|status| status.code());
        let exit = code.and_then(Exit::from_code).or(self.reported());
        let report = std::mem::take(&mut self.report);
        Err(match (exit, self.shutdown.as_deref()) {
            (Some(Exit::Left), _) if self.leaving => return Ok(()),
            (Some(Exit::Panic), _) => Verdict::Panic { report },
            (Some(Exit::Exception), _) => Verdict::Exception { report },
            (Some(Exit::Adapter), _) => Verdict::Adapter { report },
            (_, Some("guest-reset")) if self.hello => Verdict::TripleFault { booted: false },
            (_, Some("guest-reset")) => Verdict::BootLoader {
                reset: true,
                found: Found::default(),
            },
            // SDL's window gives the reason `host-ui` when it is closed. GTK's window gives `host-qmp-quit`.
            // So does this program's `quit`, but only after the user's request or an earlier reason, which
            // stays.
            (_, Some("host-ui" | "host-qmp-quit" | "host-qmp-system-reset" | "host-signal")) => {
                Verdict::User
            }
            _ => Verdict::Qemu {
                words: std::mem::take(&mut self.words),
                status: self.ended,
            },
        })
    }

    /// Returns the exit that a complete report announces, in case QEMU's exit code does not show it.
    fn reported(&self) -> Option<Exit> {
        let first = self.report.first()?.split(' ').next()?;
        let ends = [
            (PANIC, Exit::Panic),
            (EXCEPTION, Exit::Exception),
            (ADAPTER, Exit::Adapter),
        ];
        let end = ends.into_iter().find(|(word, _)| *word == first)?;
        (self.report.last()? == END_OF_REPORT).then_some(end.1)
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::process::ExitStatusExt;

    use super::*;

    const HELLO: &str = "com1 hello crystal-ball 0.1.0 protocol ";
    /// Recorded messages, without their time stamps, which no code reads.
    const GUEST_SHUTDOWN: &str =
        r#"qmp {"event": "SHUTDOWN", "data": {"guest": true, "reason": "guest-shutdown"}}"#;
    const GUEST_RESET: &str =
        r#"qmp {"event": "SHUTDOWN", "data": {"guest": true, "reason": "guest-reset"}}"#;
    const QUIT: &str =
        r#"qmp {"event": "SHUTDOWN", "data": {"guest": false, "reason": "host-qmp-quit"}}"#;
    const SIGNAL: &str =
        r#"qmp {"event": "SHUTDOWN", "data": {"guest": false, "reason": "host-signal"}}"#;
    const SYSTEM_RESET: &str =
        r#"qmp {"event": "SHUTDOWN", "data": {"guest": false, "reason": "host-qmp-system-reset"}}"#;
    const POWERDOWN: &str = r#"qmp {"event": "POWERDOWN"}"#;
    const STOP: &str = r#"qmp {"event": "STOP"}"#;
    const RESUME: &str = r#"qmp {"event": "RESUME"}"#;

    /// Returns a run that has received `events`, and the actions that followed.
    fn played(events: &[&str]) -> (Run, Vec<Act>) {
        let (mut run, mut acts) = (Run::default(), Vec::new());
        run.started = true;
        for event in events {
            let (from, rest) = event.split_once(' ').unwrap();
            let event = match from {
                "qmp" => Event::Control(serde_json::from_str(rest).unwrap()),
                "com1" if *event == HELLO => Event::Line(format!("{rest}{}", protocol::PROTOCOL)),
                "com1" => Event::Line(rest.into()),
                "words" => Event::Words(rest.into()),
                "end" => {
                    run.take(Event::SerialClosed);
                    run.take(Event::ControlClosed);
                    let number: i32 = rest.parse().unwrap();
                    // The wait status: a negative number stands for a signal.
                    let status = if number < 0 { -number } else { number << 8 };
                    Event::Ended(Ok(ExitStatus::from_raw(status)))
                }
                other => panic!("{other}"),
            };
            acts.extend(run.take(event));
        }
        (run, acts)
    }

    fn panic_report() -> [&'static str; 3] {
        [
            "com1 panic at kernel/src/machine.rs:103:31",
            "com1 asked to, by 'fail panic'",
            "com1 end of report",
        ]
    }

    #[test]
    fn leaving_ends_well_on_every_version() {
        let old = [HELLO, "com1 ok leave", "end 33"];
        let new = [HELLO, "com1 ok leave", GUEST_SHUTDOWN, STOP, QUIT, "end 33"];
        for (events, asked) in [(&old[..], &[][..]), (&new, &[Act::Quit])] {
            let (mut run, acts) = played(events);
            assert_eq!(acts, asked);
            assert!(run.is_decided());
            run.leaving = true;
            assert_eq!(run.verdict(), Ok(()));
            // A kernel that leaves without the command is a failure.
            let (mut run, _) = played(events);
            assert_eq!(run.verdict().unwrap_err().exit_code(), 15);
        }
    }

    #[test]
    fn a_report_is_judged_on_every_version() {
        let kinds = [
            ("panic", 35, 10),
            ("exception", 37, 11),
            ("adapter", 39, 17),
        ];
        for (word, code, ours) in kinds {
            let first = format!("com1 {word} somewhere");
            let end = format!("end {code}");
            let said = [HELLO, &first, "com1 end of report"];
            let old = [&said[..], &[&end]].concat();
            let new = [&said[..], &[GUEST_SHUTDOWN, STOP, QUIT, &end]].concat();
            // QEMU had to be killed: the report decides.
            let killed = [&said[..], &[GUEST_SHUTDOWN, STOP, "end -9"]].concat();
            for (events, quits) in [(old, 0), (new, 1), (killed, 1)] {
                let (mut run, acts) = played(&events);
                assert_eq!(acts[0], Act::Acknowledge, "{events:?}");
                assert_eq!(acts.len(), 1 + quits, "{events:?}");
                assert!(run.is_decided());
                assert_eq!(run.verdict().unwrap_err().exit_code(), ours, "{events:?}");
            }
        }
    }

    #[test]
    fn a_report_cut_short_by_qemus_death_is_qemus() {
        let [first, second, _] = panic_report();
        let (mut run, _) = played(&[HELLO, first, second, "end -9"]);
        assert_eq!(run.verdict().unwrap_err().exit_code(), 15);
    }

    #[test]
    fn a_reset_is_judged_while_the_machine_stands() {
        let (mut run, acts) = played(&[HELLO, GUEST_RESET, STOP]);
        assert_eq!(acts, []);
        assert!(run.is_decided() && run.paused.is_none());
        let fault = Verdict::TripleFault { booted: false };
        assert_eq!(run.verdict(), Err(fault));
        let (mut run, _) = played(&[GUEST_RESET, STOP]);
        assert_eq!(run.verdict().unwrap_err().exit_code(), 14);
        let (mut run, _) = played(&[HELLO, HELLO]);
        assert!(run.is_decided());
        let fault = Verdict::TripleFault { booted: true };
        assert_eq!(run.verdict(), Err(fault));
    }

    #[test]
    fn what_a_user_does_at_the_window_is_the_users() {
        for (events, quits) in [
            (&[HELLO, QUIT, "end 0"][..], true),
            (&[HELLO, SIGNAL, "end 0"], true),
            // Reset in the window's menu: `-no-reboot` turns it into a shutdown, and the machine stands
            // still.
            (&[HELLO, SYSTEM_RESET, STOP, QUIT, "end 0"], true),
            (&[HELLO, POWERDOWN, QUIT, "end 0"], true),
            // The window was closed during a pause.
            (&[HELLO, STOP, QUIT, "end 0"], true),
        ] {
            let (mut run, acts) = played(events);
            assert_eq!(acts.contains(&Act::Quit), quits, "{events:?}");
            assert!(run.is_decided() && run.paused.is_none());
            assert_eq!(run.verdict(), Err(Verdict::User), "{events:?}");
        }
    }

    /// QEMU's last message may be read after its end is known, and it contains the reason of a shutdown.
    #[test]
    fn the_last_message_is_waited_for() {
        let (mut run, _) = played(&[HELLO, POWERDOWN]);
        run.take(Event::Ended(Ok(ExitStatus::from_raw(0))));
        run.take(Event::SerialClosed);
        assert!(!run.is_decided());
        let (_, quit) = QUIT.split_once(' ').unwrap();
        run.take(Event::Control(serde_json::from_str(quit).unwrap()));
        run.take(Event::ControlClosed);
        assert!(run.is_decided());
        assert_eq!(run.verdict(), Err(Verdict::User));
    }

    #[test]
    fn only_a_user_pauses() {
        let status = |name: &str| format!(r#"qmp {{"return": {{"status": "{name}"}}, "id": 7}}"#);
        let (run, acts) = played(&[HELLO, STOP]);
        assert_eq!(acts, [Act::AskStatus]);
        assert!(run.paused.is_some());
        for name in ["paused", "debug", "save-vm"] {
            let (run, _) = played(&[HELLO, STOP, &status(name)]);
            assert!(run.paused.is_some() && !run.is_decided(), "{name}");
        }
        let (run, _) = played(&[HELLO, STOP, &status("running")]);
        assert!(run.paused.is_none());
        let (run, _) = played(&[HELLO, STOP, RESUME]);
        assert!(run.paused.is_none());
        // A machine that is off is not paused, whichever of the two events comes first.
        for events in [[HELLO, GUEST_SHUTDOWN, STOP], [HELLO, STOP, GUEST_SHUTDOWN]] {
            let (run, acts) = played(&events);
            assert!(run.paused.is_none() && run.shutdown.is_some(), "{events:?}");
            assert_eq!(acts.last(), Some(&Act::Quit), "{events:?}");
        }
        let error = r#"qmp {"event": "BLOCK_IO_ERROR", "data": {"action": "stop"}}"#;
        let (mut run, _) = played(&[HELLO, error, STOP, &status("io-error")]);
        assert!(run.is_decided());
        let said = run.verdict().unwrap_err();
        assert_eq!(said.exit_code(), 15);
        let said = said.to_string();
        assert!(said.contains("BLOCK_IO_ERROR"), "{said}");
        assert!(said.contains("'io-error'"), "{said}");
    }

    #[test]
    fn a_list_that_was_asked_for_is_printed_and_no_failure() {
        let (mut run, _) = played(&["words Supported machines are:", "words none", "end 0"]);
        assert_eq!(run.printed(), None, "the machine had been started");
        run.started = false;
        assert_eq!(run.printed().unwrap(), "Supported machines are:\nnone\n");
        for events in [&["words no such machine", "end 1"][..], &["end 0"]] {
            let (mut run, _) = played(events);
            run.started = false;
            assert_eq!(run.printed(), None, "{events:?}");
        }
        let (mut run, _) = played(&["words Log items", "end 1"]);
        (run.started, run.asked_for_list) = (false, true);
        assert_eq!(run.printed().unwrap(), "Log items\n");
    }
}
