//! Commands: what each command does, and the reasons for a refusal. The answers' lines are in `answers.rs`.

use core::fmt;

use modex::Bus;
use protocol::{Action, Change, Command, ERROR, FrameName, Motion, OK, Setting, Word};
use scene::Pose;

use crate::frame::{self, pose_after};
use crate::log::{Log, LogError};
use crate::steering::{State, StateChange, UnknownName};
use crate::{Demo, Out, Pace, Request};

/// Why a command is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// A change or a setting has an unknown name.
    Name(UnknownName),
    /// The distance of this frame is out of range.
    Distance(FrameName),
    /// A motion changes this distance to a distance that is out of range.
    Motion(i32),
    /// `steer` was sent with a tick while the demo is running.
    TickWhileRunning,
    /// `steer` was sent without a tick while the demo is held.
    NoTickWhileHeld,
    /// An action of the overlay was sent while the demo is held.
    OverlayWhileHeld,
    /// The change cannot be added to the log.
    Log(LogError),
    /// The log was full, so the state at this tick is unknown.
    LostChanges(u32),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let most = Pose::MAX_DISTANCE;
        match self {
            Self::Name(UnknownName(setting, name)) => write!(
                f,
                "unknown {setting} '{name}'; '{setting}' lists the known names"
            ),
            Self::Distance(frame) => write!(
                f,
                "the distance of '{frame}' is out of range; use 0 to {most:08x}"
            ),
            Self::Motion(distance) => write!(
                f,
                "the motion moves the distance {distance:08x} out of range; use a motion that keeps the \
                 distance in 0 to {most:08x}"
            ),
            Self::TickWhileRunning => f.write_str("the demo is running; leave out the tick"),
            Self::NoTickWhileHeld => f.write_str("the demo is held; use 'steer TICK CHANGE'"),
            Self::OverlayWhileHeld => f.write_str("a held demo has no overlay; use 'run' first"),
            Self::Log(LogError::Before(last)) => write!(
                f,
                "the tick is before the last logged change; use {last} or a later tick"
            ),
            Self::Log(LogError::Full) => write!(
                f,
                "the log is full with {} changes; use 'hold' to empty it",
                Log::MAX
            ),
            Self::LostChanges(tick) => write!(
                f,
                "the log was full and lacks changes before tick {tick}; use an earlier tick"
            ),
        }
    }
}

impl<B: Bus> Demo<'_, B> {
    /// Carries out a command and writes its answer.
    pub fn obey(&mut self, command: Command, tick: u32, out: &mut Out<'_>) -> Option<Request> {
        if let Command::Fail(kind) = command {
            return Some(Request::Fail(kind));
        }
        match self.carry_out(command, tick, out) {
            Ok(()) => {
                out(format_args!("{OK} {command}"));
                (command == Command::Leave).then_some(Request::Leave)
            }
            Err(refusal) => {
                out(format_args!("{ERROR} {refusal}"));
                None
            }
        }
    }

    /// Carries out a command and writes its answer, without the last line.
    fn carry_out(&mut self, command: Command, tick: u32, out: &mut Out<'_>) -> Result<(), Refusal> {
        match command {
            Command::Hold => {
                let scenes = self.state.scenes;
                let state = State::new(scenes, scenes.default());
                self.log.restart(state);
                // One reset serves both calls, whatever they return.
                let _ = (self.set_state(state), self.stop());
                self.presentation.reset();
            }
            Command::Run => {
                if self.pace.is_none() {
                    self.state = self.state.unsteered();
                    self.log.restart(self.state);
                }
                self.pace = Some(Pace::default());
            }
            Command::Show(frame) => {
                self.show(frame, None)?;
                self.write_page(out);
            }
            Command::ShowMoving(frame, motion) => {
                self.show(frame, Some(motion))?;
                self.write_page(out);
            }
            Command::ShowAt(tick) => {
                self.show_at(tick)?;
                self.write_page(out);
            }
            Command::Set(setting, None) => self.write_values(setting, out),
            Command::Set(setting, Some(name)) => self.set(setting, name, tick)?,
            Command::Steer(at, change) => self.steer_at(at, change, tick)?,
            Command::Log => self.write_log(out),
            Command::Keys => self.write_keys(out),
            Command::Dump(content) => self.write_dump(content, out),
            Command::Checksums(content) => self.write_checksums(content, out),
            Command::Registers => self.write_registers(out),
            Command::Counts => self.write_counts(tick, out),
            Command::State => self.write_state(tick, out),
            Command::Version => self.write_version(out),
            Command::Fail(_) | Command::Leave => {}
        }
        Ok(())
    }

    /// Shows a frame by its name; with `motion`, in reduced quality.
    fn show(&mut self, frame: FrameName, motion: Option<Motion>) -> Result<(), Refusal> {
        let pose = frame::pose(self.state.entry(), frame).ok_or(Refusal::Distance(frame))?;
        let next = match motion {
            Some(motion) => Some(pose_after(&pose, motion).ok_or(Refusal::Motion(pose.distance))?),
            None => None,
        };
        if self.stop() {
            self.presentation.reset();
        }
        self.presentation
            .draw(frame, &pose, next, &self.state, None);
        Ok(())
    }

    /// Shows the frame that the log defines for a tick.
    fn show_at(&mut self, tick: u32) -> Result<(), Refusal> {
        let state = self.log.state(tick).ok_or(Refusal::LostChanges(tick))?;
        let was_running = self.stop();
        let scene_changed = self.set_state(state);
        if was_running || scene_changed {
            self.presentation.reset();
        }
        self.draw_at(tick);
        Ok(())
    }

    /// Changes a setting to a name.
    fn set(&mut self, setting: Setting, name: Word, tick: u32) -> Result<(), Refusal> {
        let change = self.resolve(Change::Set(setting, name))?;
        if self.pace.is_some() {
            self.steer(tick, change);
            return Ok(());
        }
        let mut next = self.state;
        next.apply(tick, change);
        self.log.start_mut().apply(tick, change);
        let scene_changed = self.set_state(next);
        if scene_changed || setting == Setting::Scene {
            self.presentation.reset();
        }
        Ok(())
    }

    /// Changes a running demo now, or adds a change at a tick to the log of a held demo.
    fn steer_at(&mut self, at: Option<u32>, change: Change, tick: u32) -> Result<(), Refusal> {
        let change = self.resolve(change)?;
        match (self.pace, at) {
            (Some(_), None) => {
                self.steer(tick, change);
                Ok(())
            }
            (Some(_), Some(_)) => Err(Refusal::TickWhileRunning),
            (None, _) if matches!(change, StateChange::Act(action) if action.is_overlay()) => {
                Err(Refusal::OverlayWhileHeld)
            }
            (None, None) => Err(Refusal::NoTickWhileHeld),
            (None, Some(at)) => self.log.add(at, change).map_err(Refusal::Log),
        }
    }

    fn resolve(&self, change: Change) -> Result<StateChange, Refusal> {
        self.state.scenes.resolve(change).map_err(Refusal::Name)
    }

    /// Changes the running demo, from the first tick whose frame is not drawn yet, and logs the change.
    pub(crate) fn steer(&mut self, tick: u32, change: StateChange) {
        let is_drawn = self.pace.is_some_and(|pace| pace.last == Some(tick));
        let tick = if is_drawn { tick.wrapping_add(1) } else { tick };
        if let StateChange::Act(action) = change {
            self.overlay.act(tick, action);
        }
        let mut next = self.state;
        let changed = next.apply(tick, change);
        if self.set_state(next) {
            self.presentation.reset();
        }
        if change == StateChange::Act(Action::Reset) {
            // A reset starts from defaults, so earlier changes no longer matter.
            self.log.restart(next);
        } else if changed {
            self.log.add_or_count(tick, change);
        }
    }
}
