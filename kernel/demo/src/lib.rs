//! The demo: draws frames, one after the other, and answers commands.
//!
//! A running demo draws the frame of each tick for as long as the machine keeps up, and skips ticks when it
//! does not, so the motion keeps its pace. A held demo draws what `show` names and touches no video memory
//! between commands, so the screen's content can serve as evidence.
//!
//! Keys and commands steer a running demo (`steering`). The demo logs them (`log`), and a held demo draws the
//! frame of any tick from that log.
//!
//! The demo does not depend on the machine. It draws on a card behind a [`modex::Bus`], receives bytes,
//! writes lines, and gets the tick as an argument. The kernel passes the bare machine's card and its serial
//! line; a test passes the emulated VGA and a list. The same commands then give the same answers.
//!
//! # Example
//!
//! ```
//! use demo::{Demo, DemoMemory};
//! use protocol::Command;
//! use vga::Vga;
//!
//! // The memory is too large for the stack of a thread.
//! let mut memory = in_place::boxed!(DemoMemory);
//! let mut demo = Demo::new(&mut memory, Vga::new(), None).unwrap();
//! let mut lines = Vec::new();
//! for line in ["hold", "show 480", "checksums"] {
//!     let command = Command::parse(line).unwrap();
//!     demo.obey(command, 0, &mut |line| lines.push(line.to_string()));
//! }
//! assert_eq!(
//!     lines,
//!     [
//!         "ok hold",
//!         "page 1",
//!         "ok show 480",
//!         "page start 4b00 crc 9eb83d0b",
//!         "palette crc ded195c3",
//!         "ok checksums",
//!     ]
//! );
//! ```
#![no_std]
#![forbid(unsafe_code)]

mod answers;
mod commands;
mod frame;
mod keys;
mod log;
mod overlay;
mod palette;
mod presentation;
mod split;
mod steering;
mod text;
mod trajectory;

use core::fmt;

use model::{Arena, ModelFile};
use modex::{Bus, Offscreen, SetError};
use protocol::{Command, ERROR, FailKind, FrameName, Lines, RUNNING, Reception};
use render::RenderMemory;
use scene::catalogue::MAX_TEXELS;

pub use frame::pose;
use keys::Keyboard;
pub use keys::{KEYS, Key};
use log::{Log, LogMemory};
use overlay::{FrameStatistics, Overlay};
use presentation::Presentation;
pub use split::HEAT;
use steering::{Scenes, State, StateChange};
use text::TextLayer;

/// The program's version, as the kernel's first line and `version` print it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A sink for an answer's lines, each without its checksum.
pub type Out<'a> = dyn FnMut(fmt::Arguments<'_>) + 'a;

/// The fixed memory of the demo, about 3.2 MiB. It is meant for a static.
#[derive(Clone, Copy, Debug)]
pub struct DemoMemory {
    model: Arena,
    texels: [u8; MAX_TEXELS],
    render: RenderMemory,
    offscreen: Offscreen,
    log: LogMemory,
    text: TextLayer,
}

impl DemoMemory {
    /// Returns empty memory.
    pub const fn new() -> Self {
        Self {
            model: Arena::new(),
            texels: [0; MAX_TEXELS],
            render: RenderMemory::new(),
            offscreen: Offscreen::new(),
            log: Log::MEMORY,
            text: TextLayer::new(),
        }
    }
}

impl Default for DemoMemory {
    fn default() -> Self {
        Self::new()
    }
}

/// A request that only the machine can carry out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Fail in this way.
    Fail(FailKind),
    /// End the program, as `leave` asks.
    Leave,
}

/// How a running demo keeps up with the ticks.
#[derive(Clone, Copy, Debug, Default)]
struct Pace {
    /// The tick of the last frame.
    last: Option<u32>,
    /// Number of frames shown.
    frames: u32,
    /// Number of frames that came more than one tick after the frame before.
    late: u32,
}

/// What arrives from the keyboard and on the serial line.
#[derive(Debug)]
struct Input {
    keyboard: Keyboard,
    /// Codes from the keyboard that the demo has handled.
    handled_codes: u32,
    /// Codes that were lost before the demo fetched them.
    lost_codes: u32,
    lines: Lines,
    /// Errors of the serial line.
    reception: Reception,
}

impl Input {
    fn new() -> Self {
        Self {
            keyboard: Keyboard::new(),
            handled_codes: 0,
            lost_codes: 0,
            lines: Lines::new(),
            reception: Reception::default(),
        }
    }
}

/// A card, and the demo that draws on it.
#[derive(Debug)]
pub struct Demo<'a, B> {
    presentation: Presentation<'a, B>,
    /// The state that the next frame depends on; `log` has the changes that led to it.
    state: State<'a>,
    log: Log<'a>,
    overlay: Overlay<'a>,
    input: Input,
    /// `None` while the demo is held.
    pace: Option<Pace>,
    /// The checksum of the model file that contains the loaded model.
    model_file: Option<u32>,
}

impl<'a, B: Bus> Demo<'a, B> {
    /// Paints the default scene into `memory`, sets the card's mode, and starts a running demo. The model of
    /// `model_file` becomes a scene beside the built-in scenes, and the default. Without a model file, the
    /// ball is the default.
    ///
    /// # Errors
    /// As [`ModeX::set`](modex::ModeX::set): nothing can be drawn on this card.
    pub fn new(
        memory: &'a mut DemoMemory,
        bus: B,
        model_file: Option<&ModelFile<'a>>,
    ) -> Result<Self, SetError> {
        let DemoMemory {
            model,
            texels,
            render,
            offscreen,
            log,
            text,
        } = memory;
        let scenes = Scenes::new(model_file.map(|model_file| model_file.entry(model)));
        let state = State::new(scenes, scenes.default());
        let presentation = Presentation::new(bus, state.entry(), texels, render, offscreen)?;
        Ok(Self {
            state,
            log: Log::new(state, log),
            overlay: Overlay::new(text, presentation.palette()),
            presentation,
            input: Input::new(),
            pace: Some(Pace::default()),
            model_file: model_file.map(ModelFile::checksum),
        })
    }

    /// Returns the card's bus.
    pub fn bus(&mut self) -> &mut B {
        self.presentation.card.bus().inner()
    }

    /// Returns whether the demo runs and the frame of `tick` is not on the screen yet.
    pub fn is_due(&self, tick: u32) -> bool {
        self.pace.is_some_and(|pace| pace.last != Some(tick))
    }

    /// Shows the running demo's frame of `tick`.
    pub fn present(&mut self, tick: u32, out: &mut Out<'_>) {
        self.draw_at(tick);
        let Some(pace) = &mut self.pace else { return };
        let before = pace.last.replace(tick);
        pace.late += u32::from(before.is_some_and(|before| tick.wrapping_sub(before) > 1));
        pace.frames = pace.frames.wrapping_add(1);
        if before.is_none() {
            out(format_args!("{RUNNING}"));
        }
    }

    /// Adds the duration of the last frame, in microseconds. Only the machine has a clock for that.
    pub fn add_frame_time(&mut self, micros: u32) {
        self.overlay.add_frame_time(micros);
    }

    /// Handles a code of the keyboard, in scan code set 1. Keys do not steer a held demo.
    pub fn key(&mut self, code: u8, tick: u32) {
        self.input.handled_codes = self.input.handled_codes.wrapping_add(1);
        if let Some(action) = self.input.keyboard.push(code)
            && self.pace.is_some()
        {
            self.steer(tick, StateChange::Act(action));
        }
    }

    /// Sets how many codes the machine has lost since its start because the demo did not fetch them in time.
    pub fn set_lost_keys(&mut self, codes: u32) {
        self.input.lost_codes = codes;
    }

    /// Sets the serial line's errors since the machine's start.
    pub fn set_reception(&mut self, reception: Reception) {
        self.input.reception = reception;
    }

    /// Marks the serial line as damaged: bytes before the next byte may be missing, or the next byte arrived
    /// damaged. The line of the next byte is refused ([`Lines::damage`]).
    pub fn damage(&mut self) {
        self.input.lines.damage();
    }

    /// Handles a byte from the serial line. If the byte ends a line, carries out the line's command.
    pub fn receive(&mut self, byte: u8, tick: u32, out: &mut Out<'_>) -> Option<Request> {
        let command = match self.input.lines.push(byte)? {
            Ok(line) => Command::parse(line),
            Err(error) => {
                out(format_args!("{ERROR} {error}"));
                return None;
            }
        };
        match command {
            Ok(command) => self.obey(command, tick, out),
            Err(error) => {
                out(format_args!("{ERROR} {error}"));
                None
            }
        }
    }

    /// Draws the frame of a tick on the next page, and flips.
    fn draw_at(&mut self, tick: u32) {
        let pose = self.state.pose(tick);
        let frame = if pose == self.state.entry().pose(tick) {
            FrameName::Number(tick)
        } else {
            frame::name(&pose)
        };
        let next = self
            .state
            .reduced_quality
            .then(|| self.state.next_pose(tick));
        let has_overlay = self.pace.is_some() && self.prepare_overlay(tick);
        let overlay = has_overlay.then_some(&self.overlay);
        self.presentation
            .draw(frame, &pose, next, &self.state, overlay);
    }

    /// Prepares the overlay for the frame of a tick. Returns whether the frame has an overlay.
    fn prepare_overlay(&mut self, tick: u32) -> bool {
        let (presentation, state) = (&mut self.presentation, &self.state);
        let drawn = presentation.drawn;
        let counts = presentation.card.bus().counts();
        let figures = FrameStatistics {
            scene: state.entry().name,
            mapper: state.mapper,
            order: state.order,
            paused: state.is_paused(),
            reduced_faces: state.reduced_quality.then_some(drawn.reduced),
            map_masks: counts.draw.map_mask + counts.erase.map_mask,
            pixels: drawn.stats.pixels,
            largest_error: presentation.largest_error,
        };
        self.overlay.prepare(tick, &figures, || {
            presentation.texture_motion(&state.pose(tick), &state.next_pose(tick))
        })
    }

    /// Makes `state` the state of the next frame. Returns whether the scene changed; the caller must then
    /// reset the presentation.
    #[must_use]
    fn set_state(&mut self, state: State<'a>) -> bool {
        let scene_changed = state.scene != self.state.scene;
        self.state = state;
        if scene_changed {
            self.presentation.set_scene(self.state.entry());
            self.overlay.set_palette(self.presentation.palette());
        }
        self.overlay.invalidate();
        scene_changed
    }

    /// Stops the demo. Returns whether it ran; the caller must then reset the presentation, so that later
    /// frames depend on the commands alone, and not on how far the demo had run.
    #[must_use]
    fn stop(&mut self) -> bool {
        self.overlay.close();
        self.pace.take().is_some()
    }
}
