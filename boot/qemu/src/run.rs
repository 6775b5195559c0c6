//! The state of a run, derived from its events alone, and the verdict on it.
//!
//! Nothing here waits or talks to QEMU: [`RunState::handle`] returns the action that the caller must carry
//! out. A test can therefore judge the recorded events of any QEMU version.

use std::collections::VecDeque;
use std::process::ExitStatus;
use std::time::Instant;

use protocol::{ADAPTER, END_OF_REPORT, EXCEPTION, Exit, HELLO, LOADED, PANIC, REFUSED};
use serde_json::Value;

use super::verdict::{BootDiagnosis, Verdict};

/// Run states in which QEMU itself has stopped the machine and that the user does not end. QEMU's other
/// stopped states are the user's pause, a debugger's stop, and temporary states.
const QEMU_STOPPED: [&str; 4] = ["guest-panicked", "internal-error", "io-error", "watchdog"];
/// QEMU's events that explain these states. Their data is kept for the message.
const EXPLAINING_EVENTS: [&str; 4] = [
    "BLOCK_IO_ERROR",
    "GUEST_PANICKED",
    "MEMORY_FAILURE",
    "WATCHDOG",
];

/// An event of a running QEMU.
#[derive(Debug)]
pub enum VmEvent {
    /// A line on the serial line with a correct checksum.
    Line(String),
    /// Invalid data on the serial line, as a description of the error.
    Garbled(String),
    /// A message on the control socket.
    Control(Value),
    /// A line of QEMU's standard error, which also receives its standard output.
    Output(String),
    /// QEMU's end.
    Ended(std::io::Result<ExitStatus>),
    /// Everything on the serial line has been read.
    SerialClosed,
    /// Everything on the control socket has been read.
    ControlClosed,
}

/// The action that the caller must carry out after an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// Send QEMU `quit`: the machine is off, and QEMU may otherwise wait for ever.
    Quit,
    /// Send QEMU `query-status` to find out why the machine has stopped.
    QueryStatus,
    /// Take the last screendump and acknowledge the kernel's report.
    Acknowledge,
}

/// The state of a run.
#[derive(Debug, Default)]
pub struct RunState {
    /// The kernel's first line has come.
    pub hello: bool,
    /// The kernel's line about the model file in its ramdisk: accepted or refused.
    pub model_file: Option<String>,
    /// The user's arguments request a list from QEMU (`-d help`).
    pub wants_list: bool,
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
    pub output: Vec<String>,
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

impl RunState {
    /// Updates the state with an event, and returns the action that follows from it.
    pub fn handle(&mut self, event: VmEvent) -> Option<Reaction> {
        match event {
            VmEvent::Line(line) => return self.handle_line(line),
            VmEvent::Control(message) => return self.handle_control(message),
            VmEvent::Garbled(why) => self.decide(Verdict::Garbled { why }),
            VmEvent::Output(line) => self.output.push(line),
            VmEvent::Ended(Ok(status)) => self.ended = Some(status),
            VmEvent::Ended(Err(error)) => self.output.push(error.to_string()),
            VmEvent::SerialClosed => self.serial_closed = true,
            VmEvent::ControlClosed => self.control_closed = true,
        }
        None
    }

    fn handle_line(&mut self, line: String) -> Option<Reaction> {
        let word = line.split(' ').next().unwrap_or("");
        if word == HELLO {
            let supported = format!("protocol {}", protocol::PROTOCOL);
            if self.hello {
                self.decide(Verdict::TripleFault { booted: true });
            } else if !line.ends_with(&supported) {
                let why = format!(
                    "the kernel's first line is '{line}', but this program supports {supported}"
                );
                self.decide(Verdict::Garbled { why });
            }
            self.hello = true;
        } else if [LOADED, REFUSED].contains(&word) {
            self.model_file = Some(line);
        } else if [PANIC, EXCEPTION, ADAPTER].contains(&word) || !self.report.is_empty() {
            let is_complete = line == END_OF_REPORT;
            self.report.push(line);
            return is_complete.then_some(Reaction::Acknowledge);
        } else {
            self.lines.push_back(line);
        }
        None
    }

    fn handle_control(&mut self, message: Value) -> Option<Reaction> {
        let Some(event) = message.get("event").and_then(Value::as_str) else {
            // QMP's greeting and its events have no `id`; only replies have one.
            if message.get("id").is_some() {
                self.handle_status(&message["return"]["status"]);
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
                // reset itself gets no `quit`: it is judged while QEMU keeps it stopped.
                return (reason != "guest-reset").then_some(Reaction::Quit);
            }
            // The user asked for a power-down in the window's menu or at the monitor. The kernel does not
            // notice it.
            "POWERDOWN" => return Some(Reaction::Quit),
            "RESET" => self.reset = true,
            // A machine that is off sends `STOP` too, but no user has paused it.
            "STOP" if self.shutdown.is_none() => {
                self.paused.get_or_insert_with(Instant::now);
                return Some(Reaction::QueryStatus);
            }
            "RESUME" => self.paused = None,
            event if EXPLAINING_EVENTS.contains(&event) => {
                self.output.push(format!("({event}: {})", message["data"]));
            }
            _ => {}
        }
        None
    }

    /// Updates the state with the machine's run state, given by QEMU's name for it.
    fn handle_status(&mut self, status: &Value) {
        match status.as_str() {
            Some("running") => self.paused = None,
            Some(status) if QEMU_STOPPED.contains(&status) => {
                let mut output = self.output.clone();
                output.push(format!("(QEMU stopped the machine: '{status}')"));
                self.decide(Verdict::Qemu {
                    output,
                    status: None,
                });
            }
            _ => {}
        }
    }

    /// Keeps the verdict, unless an earlier verdict is already certain.
    fn decide(&mut self, verdict: Verdict) {
        self.certain.get_or_insert(verdict);
    }

    /// Returns whether the machine was reset. It may be running again.
    pub fn was_reset(&self) -> bool {
        self.reset || self.shutdown.as_deref() == Some("guest-reset")
    }

    /// Returns whether the verdict is certain. QEMU's end alone is not enough: the last lines of the kernel
    /// and of QEMU may still be unread.
    pub fn is_decided(&self) -> bool {
        self.certain.is_some()
            || self.shutdown.as_deref() == Some("guest-reset")
            || (self.ended.is_some() && self.serial_closed && self.control_closed)
    }

    /// Returns QEMU's output if its arguments only requested a list (`-machine help`): QEMU ended
    /// successfully before the machine was started. QEMU 7.2 ends `-d help` with exit code 1.
    pub fn printed(&self) -> Option<String> {
        let code = self.ended.and_then(|status| status.code());
        let succeeded = code == Some(0) || (code == Some(1) && self.wants_list);
        (succeeded && !self.started && !self.output.is_empty())
            .then(|| self.output.join("\n") + "\n")
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
                diagnosis: BootDiagnosis::default(),
            },
            // SDL's window gives the reason `host-ui` when it is closed. GTK's window gives `host-qmp-quit`.
            // So does this program's `quit`, but only after the user's request or an earlier reason, which
            // stays.
            (_, Some("host-ui" | "host-qmp-quit" | "host-qmp-system-reset" | "host-signal")) => {
                Verdict::User
            }
            _ => Verdict::Qemu {
                output: std::mem::take(&mut self.output),
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

    /// Returns a run that has received `events`, and its reactions.
    fn played(events: &[&str]) -> (RunState, Vec<Reaction>) {
        let (mut run, mut reactions) = (RunState::default(), Vec::new());
        run.started = true;
        for event in events {
            let (from, rest) = event.split_once(' ').unwrap();
            let event = match from {
                "qmp" => VmEvent::Control(serde_json::from_str(rest).unwrap()),
                "com1" if *event == HELLO => VmEvent::Line(format!("{rest}{}", protocol::PROTOCOL)),
                "com1" => VmEvent::Line(rest.into()),
                "output" => VmEvent::Output(rest.into()),
                "end" => {
                    run.handle(VmEvent::SerialClosed);
                    run.handle(VmEvent::ControlClosed);
                    let number: i32 = rest.parse().unwrap();
                    // The wait status: a negative number stands for a signal.
                    let status = if number < 0 { -number } else { number << 8 };
                    VmEvent::Ended(Ok(ExitStatus::from_raw(status)))
                }
                other => panic!("{other}"),
            };
            reactions.extend(run.handle(event));
        }
        (run, reactions)
    }

    fn panic_report() -> [&'static str; 3] {
        [
            "com1 panic at kernel/src/machine.rs:103:31",
            "com1 asked to, by 'fail panic'",
            "com1 end of report",
        ]
    }

    #[test]
    fn a_kernel_that_leaves_on_command_succeeds_on_every_version_of_qemu() {
        let old = [HELLO, "com1 ok leave", "end 33"];
        let new = [HELLO, "com1 ok leave", GUEST_SHUTDOWN, STOP, QUIT, "end 33"];
        for (events, expected) in [(&old[..], &[][..]), (&new, &[Reaction::Quit])] {
            let (mut run, reactions) = played(events);
            assert_eq!(reactions, expected);
            assert!(run.is_decided());
            run.leaving = true;
            assert_eq!(run.verdict(), Ok(()));
            // A kernel that leaves without the command is a failure.
            let (mut run, _) = played(events);
            assert_eq!(run.verdict().unwrap_err().exit_code(), 15);
        }
    }

    #[test]
    fn a_kernels_report_gives_its_verdict_on_every_version_of_qemu() {
        let kinds = [
            ("panic", 35, 10),
            ("exception", 37, 11),
            ("adapter", 39, 17),
        ];
        for (word, code, ours) in kinds {
            let first = format!("com1 {word} somewhere");
            let end = format!("end {code}");
            let received = [HELLO, &first, "com1 end of report"];
            let old = [&received[..], &[&end]].concat();
            let new = [&received[..], &[GUEST_SHUTDOWN, STOP, QUIT, &end]].concat();
            // QEMU had to be killed: the report decides.
            let killed = [&received[..], &[GUEST_SHUTDOWN, STOP, "end -9"]].concat();
            for (events, quits) in [(old, 0), (new, 1), (killed, 1)] {
                let (mut run, reactions) = played(&events);
                assert_eq!(reactions[0], Reaction::Acknowledge, "{events:?}");
                assert_eq!(reactions.len(), 1 + quits, "{events:?}");
                assert!(run.is_decided());
                assert_eq!(run.verdict().unwrap_err().exit_code(), ours, "{events:?}");
            }
        }
    }

    #[test]
    fn a_report_that_qemus_end_cuts_short_is_a_failure_of_qemu() {
        let [first, second, _] = panic_report();
        let (mut run, _) = played(&[HELLO, first, second, "end -9"]);
        assert_eq!(run.verdict().unwrap_err().exit_code(), 15);
    }

    #[test]
    fn a_reset_gives_its_verdict_while_the_machine_is_stopped() {
        let (mut run, reactions) = played(&[HELLO, GUEST_RESET, STOP]);
        assert_eq!(reactions, []);
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
    fn an_end_through_the_window_is_ended_by_the_user() {
        for (events, quits) in [
            (&[HELLO, QUIT, "end 0"][..], true),
            (&[HELLO, SIGNAL, "end 0"], true),
            // Reset in the window's menu: `-no-reboot` turns it into a shutdown, and the machine stops.
            (&[HELLO, SYSTEM_RESET, STOP, QUIT, "end 0"], true),
            (&[HELLO, POWERDOWN, QUIT, "end 0"], true),
            // The window was closed during a pause.
            (&[HELLO, STOP, QUIT, "end 0"], true),
        ] {
            let (mut run, reactions) = played(events);
            assert_eq!(reactions.contains(&Reaction::Quit), quits, "{events:?}");
            assert!(run.is_decided() && run.paused.is_none());
            assert_eq!(run.verdict(), Err(Verdict::User), "{events:?}");
        }
    }

    /// QEMU's last message may be read after its end is known, and it contains the reason of a shutdown.
    #[test]
    fn the_verdict_waits_for_qemus_last_message() {
        let (mut run, _) = played(&[HELLO, POWERDOWN]);
        run.handle(VmEvent::Ended(Ok(ExitStatus::from_raw(0))));
        run.handle(VmEvent::SerialClosed);
        assert!(!run.is_decided());
        let (_, quit) = QUIT.split_once(' ').unwrap();
        run.handle(VmEvent::Control(serde_json::from_str(quit).unwrap()));
        run.handle(VmEvent::ControlClosed);
        assert!(run.is_decided());
        assert_eq!(run.verdict(), Err(Verdict::User));
    }

    #[test]
    fn only_a_users_stop_is_a_pause() {
        let status = |name: &str| format!(r#"qmp {{"return": {{"status": "{name}"}}, "id": 7}}"#);
        let (run, reactions) = played(&[HELLO, STOP]);
        assert_eq!(reactions, [Reaction::QueryStatus]);
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
            let (run, reactions) = played(&events);
            assert!(run.paused.is_none() && run.shutdown.is_some(), "{events:?}");
            assert_eq!(reactions.last(), Some(&Reaction::Quit), "{events:?}");
        }
        let error = r#"qmp {"event": "BLOCK_IO_ERROR", "data": {"action": "stop"}}"#;
        let (mut run, _) = played(&[HELLO, error, STOP, &status("io-error")]);
        assert!(run.is_decided());
        let verdict = run.verdict().unwrap_err();
        assert_eq!(verdict.exit_code(), 15);
        let message = verdict.to_string();
        assert!(message.contains("BLOCK_IO_ERROR"), "{message}");
        assert!(message.contains("'io-error'"), "{message}");
    }

    #[test]
    fn a_requested_list_is_printed_and_is_not_a_failure() {
        let (mut run, _) = played(&["output Supported machines are:", "output none", "end 0"]);
        assert_eq!(run.printed(), None, "the machine had been started");
        run.started = false;
        assert_eq!(run.printed().unwrap(), "Supported machines are:\nnone\n");
        for events in [&["output no such machine", "end 1"][..], &["end 0"]] {
            let (mut run, _) = played(events);
            run.started = false;
            assert_eq!(run.printed(), None, "{events:?}");
        }
        let (mut run, _) = played(&["output Log items", "end 1"]);
        (run.started, run.wants_list) = (false, true);
        assert_eq!(run.printed().unwrap(), "Log items\n");
    }
}
