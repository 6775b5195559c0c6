//! The demo: draws one frame after the other and answers commands.
//!
//! A running demo draws the frame of each tick for as long as the machine keeps up, and skips ticks when it
//! does not, so the motion keeps its pace. A held demo draws what `show` names and touches no video memory
//! between commands, so the screen's content can serve as evidence.
//!
//! Keys and commands steer a running demo. The demo logs them (`steering`), and a held demo draws the frame
//! of any tick from that log.
//!
//! The demo knows nothing of the machine. It has a card behind a [`modex::Bus`], receives bytes, writes
//! lines, and gets the tick as an argument. The kernel passes the bare machine's card and its serial line; a
//! test passes the emulated VGA and a list. The same commands then give the same answers.
#![no_std]
#![forbid(unsafe_code)]

mod keys;
mod overlay;
mod palette;
mod split;
mod steering;

use core::fmt;

use model::{Arena, ModelFile};
use modex::{Bus, Counted, Destination, HEIGHT, ModeX, Offscreen, SetError, Tally, WIDTH};
use protocol::dump::{self, Header, OrNone};
use protocol::{
    Action, Change, Command, Content, ERROR, Fault, FrameName, Lines, Motion, OK, PROTOCOL,
    RUNNING, Reception, Setting, Word,
};
use render::{Drawn, RenderMemory, RenderOptions, SceneRenderer};
use scene::Pose;
use scene::catalogue::{Entry, MAX_TEXELS};
use texmap::{Mapper, Order, Stats};

use keys::Keyboard;
pub use keys::{KEYS, Key};
use overlay::{Figures, Overlay, Writing};
pub use split::HEAT;
use split::Split;
use steering::{Log, NotNoted, Notes, Scenes, State};

/// The program's version, as the kernel's first line and `version` print it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Returns the mark that the overlay puts behind a mapper's name: `~` if any faces (`lowered`) were drawn in
/// reduced quality.
fn lower_mark(lowered: u32) -> &'static str {
    if lowered > 0 { "~" } else { "" }
}

/// A sink for an answer's lines, each without its checksum.
pub type Out<'a> = dyn FnMut(fmt::Arguments<'_>) + 'a;

/// The fixed memory of the demo, about 2.5 MiB. It is meant for a static.
#[derive(Clone, Copy, Debug)]
pub struct Memory {
    model: Arena,
    texels: [u8; MAX_TEXELS],
    storage: RenderMemory,
    offscreen: Offscreen,
    notes: Notes,
    writing: Writing,
}

impl Memory {
    /// Returns empty memory.
    pub const fn new() -> Self {
        Self {
            model: Arena::new(),
            texels: [0; MAX_TEXELS],
            storage: RenderMemory::new(),
            offscreen: Offscreen::new(),
            notes: Log::NOTES,
            writing: Writing::new(),
        }
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

/// A request that only the machine can carry out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Fail in this way.
    Fail(Fault),
    /// End the program, as `leave` asks.
    Leave,
}

/// The frame on the screen: everything except the scene that a dump's header needs to draw it again.
#[derive(Clone, Copy, Debug)]
struct Shown {
    frame: FrameName,
    /// The motion that decided which faces are drawn in reduced quality; `None` if all faces have full
    /// quality.
    motion: Option<Motion>,
    mapper: Mapper,
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

/// A card, and the demo that draws on it.
#[derive(Debug)]
pub struct Show<'a, B> {
    card: ModeX<Counted<B>>,
    /// The checksum of the model file that contains the loaded model.
    model_file: Option<u32>,
    /// The state that the next frame depends on; `log` says how it came about.
    state: State<'a>,
    log: Log<'a>,
    overlay: Overlay<'a>,
    keyboard: Keyboard,
    /// Codes from the keyboard: handled by the demo, and lost before it fetched them.
    codes: (u32, u32),
    /// Errors of the serial line.
    reception: Reception,
    /// The memory that the scene's texture is painted into.
    texels: &'a mut [u8; MAX_TEXELS],
    stage: SceneRenderer<'a>,
    offscreen: &'a mut Offscreen,
    lines: Lines,
    /// The frame on the screen; `None` after a reset of the card.
    shown: Option<Shown>,
    /// Counts of what was drawn for the last frame.
    drawn: Drawn,
    /// The largest error in the last frame if it was a split view, and 0 otherwise, in 2^-16 texel.
    most: u32,
    /// `None` while the demo is held.
    pace: Option<Pace>,
}

impl<'a, B: Bus> Show<'a, B> {
    /// Paints the default scene into `memory`, sets the card's mode, and starts a running demo. The model of
    /// `model_file` becomes a scene beside the built-in ones, and the default. Without a model file, the ball is the
    /// default.
    ///
    /// # Errors
    /// As [`ModeX::set`]: nothing can be drawn on this card.
    pub fn new(
        memory: &'a mut Memory,
        bus: B,
        model_file: Option<&ModelFile<'a>>,
    ) -> Result<Self, SetError> {
        let arena = &mut memory.model;
        let scenes = Scenes::new(model_file.map(|model_file| model_file.entry(arena)));
        let state = State::of(scenes, scenes.default());
        let textures = state.entry.paint(&mut memory.texels);
        let stage = SceneRenderer::new(&mut memory.storage, state.entry.scene(&textures));
        Ok(Self {
            model_file: model_file.map(ModelFile::checksum),
            state,
            log: Log::new(state, &mut memory.notes),
            overlay: Overlay::new(&mut memory.writing, stage.palette()),
            keyboard: Keyboard::new(),
            codes: (0, 0),
            reception: Reception::default(),
            texels: &mut memory.texels,
            card: ModeX::set(Counted::new(bus), stage.palette())?,
            stage,
            offscreen: &mut memory.offscreen,
            lines: Lines::new(),
            shown: None,
            drawn: Drawn::default(),
            most: 0,
            pace: Some(Pace::default()),
        })
    }

    /// Returns the card's bus.
    pub fn bus(&mut self) -> &mut B {
        self.card.bus().inner()
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

    /// Sets how many microseconds the last frame needed. Only the machine has a clock for that.
    pub fn took(&mut self, micros: u32) {
        self.overlay.took(micros);
    }

    /// Handles a code of the keyboard, in scan code set 1. Keys do not steer a held demo.
    pub fn key(&mut self, code: u8, tick: u32) {
        self.codes.0 = self.codes.0.wrapping_add(1);
        if let Some(action) = self.keyboard.push(code)
            && self.pace.is_some()
        {
            // An action contains no name that could be unknown.
            let _ = self.steer(tick, Change::Act(action));
        }
    }

    /// Sets how many codes the machine has lost since its start because the demo did not fetch them in time.
    pub fn set_lost_keys(&mut self, codes: u32) {
        self.codes.1 = codes;
    }

    /// Sets the serial line's errors since the machine's start.
    pub fn set_reception(&mut self, reception: Reception) {
        self.reception = reception;
    }

    /// Marks the serial line as damaged: bytes before the next byte may be missing, or the next byte arrived
    /// damaged. The line of the next byte is refused ([`Lines::damage`]).
    pub fn damage(&mut self) {
        self.lines.damage();
    }

    /// Handles a byte from the serial line. A byte that ends a line carries the line's command out.
    pub fn receive(&mut self, byte: u8, tick: u32, out: &mut Out<'_>) -> Option<Request> {
        let command = match self.lines.push(byte)? {
            Ok(line) => Command::parse(line),
            Err(noise) => {
                out(format_args!("{ERROR} {noise}"));
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

    /// Carries a command out and writes its answer.
    pub fn obey(&mut self, command: Command, tick: u32, out: &mut Out<'_>) -> Option<Request> {
        match command {
            Command::Hold => {
                let scenes = self.state.scenes;
                let state = State::of(scenes, scenes.default());
                self.log.restart(state);
                let _ = (self.adopt(state), self.hold());
                self.reset();
            }
            Command::Run => {
                if self.pace.is_none() {
                    self.state = self.state.unsteered();
                    self.log.restart(self.state);
                }
                self.pace = Some(Pace::default());
            }
            Command::Show(frame) => self.show(frame, None, out)?,
            Command::ShowMoving(frame, motion) => self.show(frame, Some(motion), out)?,
            Command::ShowAt(tick) => {
                let Some(state) = self.log.state(tick) else {
                    out(format_args!(
                        "{ERROR} the log is full, and changes before tick {tick} are not in it"
                    ));
                    return None;
                };
                let (ran, put) = (self.hold(), self.adopt(state));
                if ran || put {
                    self.reset();
                }
                self.draw_at(tick);
                self.tell_page(out);
            }
            Command::Set(setting, None) => self.list(setting, out),
            Command::Set(setting, Some(name)) => self.set(setting, name, tick, out)?,
            Command::Steer(at, change) => self.obey_steer(at, change, tick, out)?,
            Command::Log => self.tell_log(out),
            Command::Keys => {
                for key in KEYS {
                    out(format_args!("{} {}: {}", key.name, key.action, key.about));
                }
            }
            Command::Dump(content) => {
                let (header, palette) = (self.header(content), self.card.palette());
                dump::write(
                    &header,
                    &palette,
                    |at, row| self.card.load(at, row),
                    &mut *out,
                );
            }
            Command::Checksums(content) => {
                let (header, palette) = (self.header(content), self.card.palette());
                dump::write_checksums(
                    &header,
                    &palette,
                    |at, row| self.card.load(at, row),
                    &mut *out,
                );
            }
            Command::Registers => self.tell_registers(out),
            Command::Counts => self.tell_counts(tick, out),
            Command::State => self.tell_state(tick, out),
            Command::Version => out(format_args!(
                "crystal-ball {VERSION} protocol {PROTOCOL} dump {}",
                dump::VERSION
            )),
            Command::Fail(fault) => return Some(Request::Fail(fault)),
            Command::Leave => {}
        }
        out(format_args!("{OK} {command}"));
        (command == Command::Leave).then_some(Request::Leave)
    }

    /// Carries `show` out. Returns `None`, after writing why, if the command is refused.
    fn show(&mut self, frame: FrameName, motion: Option<Motion>, out: &mut Out<'_>) -> Option<()> {
        let most = Pose::MAX_DISTANCE;
        let Some(pose) = pose(&self.state.entry, frame) else {
            out(format_args!("{ERROR} a distance is 0 to {most:08x}"));
            return None;
        };
        let next = match motion.map(|motion| moved(&pose, motion)) {
            Some(None) => {
                let from = pose.distance;
                out(format_args!(
                    "{ERROR} this motion leaves the legal distances, 0 to {most:08x}; the frame's \
                     distance is {from:08x}: use a motion that keeps the sum legal"
                ));
                return None;
            }
            next => next.flatten(),
        };
        if self.hold() {
            self.reset();
        }
        self.draw(frame, &pose, next, false);
        self.tell_page(out);
        Some(())
    }

    /// Draws a frame on the next page, and flips. With `next`, the pose at the next tick, the frame is drawn
    /// in reduced quality.
    fn draw(&mut self, frame: FrameName, pose: &Pose, next: Option<Pose>, overlay: bool) {
        self.card.bus().take_counts();
        let State { mapper, order, .. } = self.state;
        let options = RenderOptions {
            mapper,
            order,
            next,
        };
        let background = self.stage.background();
        let split = self.overlay.split().filter(|_| overlay);
        (self.drawn, self.most) = match order {
            Order::Polygons | Order::Planes => {
                let mut page = self.card.begin(background);
                let drawn = paint(&mut self.stage, split, pose, options, &mut page);
                if overlay {
                    self.overlay.draw(page.overlay());
                }
                drawn
            }
            Order::Buffer => {
                self.offscreen.begin(background);
                let drawn = paint(&mut self.stage, split, pose, options, self.offscreen);
                if overlay {
                    self.overlay.draw(self.offscreen);
                }
                self.card.present(self.offscreen);
                drawn
            }
        };
        self.card.flip();
        // A motion that reduces no face's quality makes no difference, so it is not part of the name.
        let reduced = next.filter(|_| self.drawn.reduced > 0);
        self.shown = Some(Shown {
            frame,
            motion: reduced.map(|next| motion(pose, &next)),
            mapper,
        });
    }

    /// Draws the frame of a tick on the next page, and flips.
    fn draw_at(&mut self, tick: u32) {
        let pose = self.state.pose(tick);
        let own = pose == self.state.entry.pose(tick);
        let frame = if own {
            FrameName::Number(tick)
        } else {
            name(&pose)
        };
        let next = self.state.lower.then(|| self.state.next_pose(tick));
        let overlay = self.pace.is_some() && self.prepare_overlay(tick);
        self.draw(frame, &pose, next, overlay);
    }

    /// Prepares the overlay for the frame of a tick. Returns whether the frame has an overlay.
    fn prepare_overlay(&mut self, tick: u32) -> bool {
        let counts = self.card.bus().counts();
        let (stage, state) = (&mut self.stage, &self.state);
        let figures = Figures {
            scene: self.state.entry.name,
            mapper: self.state.mapper,
            order: self.state.order,
            paused: self.state.is_paused(),
            lowered: state.lower.then_some(self.drawn.reduced),
            pixels: self.drawn.stats.pixels,
            most: self.most,
            map_masks: counts.draw.map_mask + counts.erase.map_mask,
        };
        self.overlay.prepare(tick, &figures, || {
            stage.at(&state.pose(tick)).motion(&state.next_pose(tick))
        })
    }

    /// Changes the running demo, from the first tick whose frame is not drawn yet, and logs the change.
    fn steer(&mut self, tick: u32, change: Change) -> Result<(), steering::Unknown> {
        let drawn = self.pace.is_some_and(|pace| pace.last == Some(tick));
        let tick = if drawn { tick.wrapping_add(1) } else { tick };
        if let Change::Act(action) = change {
            self.overlay.act(tick, action);
        }
        let mut next = self.state;
        let changed = next.change(tick, &change)?;
        if self.adopt(next) {
            self.reset();
        }
        match change {
            // A reset starts from defaults, so earlier changes no longer matter.
            Change::Act(Action::Reset) => self.log.restart(next),
            _ if changed => self.log.keep(tick, change),
            _ => {}
        }
        Ok(())
    }

    /// Carries `steer` out. Returns `None`, after writing why, if the command is refused.
    fn obey_steer(
        &mut self,
        at: Option<u32>,
        change: Change,
        tick: u32,
        out: &mut Out<'_>,
    ) -> Option<()> {
        let noted = match (self.pace.is_some(), at) {
            (true, None) => return known(self.steer(tick, change), change, out),
            (true, Some(_)) => {
                out(format_args!(
                    "{ERROR} the show runs: it is steered now, without a tick"
                ));
                return None;
            }
            (false, _) if matches!(change, Change::Act(action) if action.is_overlay()) => {
                out(format_args!("{ERROR} a held show has no overlay"));
                return None;
            }
            (false, None) => {
                out(format_args!(
                    "{ERROR} the show is held: a tick has to be said, for 'show at'"
                ));
                return None;
            }
            (false, Some(at)) => {
                let mut state = self.state.unsteered();
                known(state.change(at, &change).map(drop), change, out)?;
                self.log.note(at, change)
            }
        };
        match noted {
            Ok(()) => return Some(()),
            Err(NotNoted::Before(last)) => out(format_args!(
                "{ERROR} a log's ticks do not go back, and the last one is {last}"
            )),
            Err(NotNoted::Full) => out(format_args!(
                "{ERROR} the log is full: it holds {} changes",
                Log::MAX
            )),
        }
        None
    }

    /// Changes a setting to a name. Returns `None`, after writing why, if the name is unknown.
    fn set(&mut self, setting: Setting, name: Word, tick: u32, out: &mut Out<'_>) -> Option<()> {
        let change = Change::Set(setting, name);
        let set = match self.pace {
            Some(_) => self.steer(tick, change),
            None => {
                let mut next = self.state;
                next.change(tick, &change).map(|_| {
                    let put = self.adopt(next);
                    // The name is known: the change to `next` succeeded.
                    let _ = self.log.start().change(tick, &change);
                    if put || setting == Setting::Scene {
                        self.reset();
                    }
                })
            }
        };
        known(set, change, out)
    }

    /// Makes `state` the state of the next frame. Returns whether the scene changed. The new scene has
    /// another palette and background, so the caller must then reset the card.
    #[must_use]
    fn adopt(&mut self, state: State<'a>) -> bool {
        let entry = state.entry;
        self.overlay.renew();
        let put = entry.name != self.state.entry.name;
        if put {
            let textures = entry.paint(self.texels);
            self.stage.set(entry.scene(&textures));
            self.offscreen.forget();
            self.overlay.set_palette(self.stage.palette());
        }
        self.state = state;
        put
    }

    /// Lists the values of a setting.
    fn list(&self, setting: Setting, out: &mut Out<'_>) {
        let mut tell = |set: bool, name: &str, about: &str| {
            let mark = if set { "*" } else { "" };
            out(format_args!("{mark}{name} {about}"));
        };
        match setting {
            Setting::Scene => {
                for entry in self.state.scenes.all() {
                    tell(entry.name == self.state.entry.name, entry.name, entry.about);
                }
            }
            Setting::Mapper => {
                for &(name, mapper, about) in Mapper::ALL {
                    tell(mapper == self.state.mapper, name, about);
                }
                let set = self.state.mapper;
                if set.name().is_empty() {
                    out(format_args!("*{set} as within-1, with another tolerance"));
                }
            }
            Setting::Order => {
                for (name, order, about) in Order::ALL {
                    tell(order == self.state.order, name, about);
                }
            }
        }
    }

    /// Stops the demo. Returns whether it ran. The caller must then reset the card, so that later frames
    /// depend on the commands alone, and not on how far the demo had come.
    #[must_use]
    fn hold(&mut self) -> bool {
        self.overlay.close();
        self.pace.take().is_some()
    }

    /// Sets the card's mode and palette again. No frame is on the card afterwards.
    fn reset(&mut self) {
        self.shown = None;
        (self.drawn, self.most) = (Drawn::default(), 0);
        self.card.bus().take_counts();
        if let Err(error) = self.card.reset(self.stage.palette()) {
            panic!("the card took Mode X before, and does not take it again: {error}");
        }
    }

    fn header(&self, content: Content) -> Header<&'static str> {
        Header {
            content,
            scene: self.state.entry.name,
            model_file: self
                .model_file
                .filter(|_| self.state.entry.name == Entry::LOADED),
            mapper: self.shown.map(|shown| {
                let name = Word::of(shown.mapper);
                name.expect("a mapper's name is a word")
            }),
            frame: self.shown.map(|shown| shown.frame),
            motion: self.shown.and_then(|shown| shown.motion),
            start: self.card.start_address(),
            width: WIDTH as u16,
            height: HEIGHT as u16,
        }
    }

    /// Waits until the last flip takes effect, and writes which page is on the screen.
    fn tell_page(&mut self, out: &mut Out<'_>) {
        self.card.settle();
        out(format_args!("page {}", self.card.shown_page()));
    }

    /// Writes the log as the commands that restore it.
    fn tell_log(&mut self, out: &mut Out<'_>) {
        let start = *self.log.start();
        out(format_args!("{} {}", Setting::Scene, start.entry.name));
        out(format_args!("{} {}", Setting::Mapper, start.mapper));
        out(format_args!("{} {}", Setting::Order, start.order));
        for (tick, change) in self.log.changes() {
            out(format_args!("{}", Command::Steer(Some(tick), *change)));
        }
        match self.log.lost() {
            0 => {}
            lost => out(format_args!("lost {lost}")),
        }
    }

    fn tell_registers(&mut self, out: &mut Out<'_>) {
        let mode = self.card.registers();
        for (block, registers) in mode.blocks() {
            out(format_args!("{block} {}", Bytes(registers)));
        }
    }

    fn tell_counts(&mut self, tick: u32, out: &mut Out<'_>) {
        let Stats {
            polygons,
            columns,
            pixels,
            dropped,
            full,
        } = self.drawn.stats;
        out(format_args!(
            "frame polygons {polygons} columns {columns} pixels {pixels} dropped {dropped} full {full}"
        ));
        for (purpose, tally) in self.card.bus().counts().named() {
            let Tally {
                ports,
                map_mask,
                stores,
                bytes,
                ..
            } = tally;
            out(format_args!(
                "{purpose} ports {ports} map-mask {map_mask} stores {stores} bytes {bytes}"
            ));
        }
        if let Some(Pace { frames, late, .. }) = self.pace {
            out(format_args!("pace frames {frames} late {late} tick {tick}"));
        }
        let (taken, lost) = self.codes;
        out(format_args!("keys taken {taken} lost {lost}"));
    }

    fn tell_state(&mut self, tick: u32, out: &mut Out<'_>) {
        match self.pace {
            Some(_) => out(format_args!("running tick {tick}")),
            None => out(format_args!("held")),
        }
        let Header {
            scene,
            mapper,
            frame,
            motion,
            ..
        } = self.header(Content::Page);
        out(format_args!("scene {scene}"));
        out(format_args!("mapper {}", self.state.mapper));
        out(format_args!("order {}", self.state.order));
        out(format_args!("frame {}", OrNone(&frame)));
        out(format_args!("motion {}", OrNone(&motion)));
        out(format_args!("drawn {}", OrNone(&mapper)));
        out(format_args!(
            "page {} start {:04x}",
            self.card.shown_page(),
            self.card.start_address()
        ));
        let Reception {
            overruns,
            damaged,
            full,
        } = self.reception;
        out(format_args!(
            "serial overruns {overruns} damaged {damaged} full {full}"
        ));
    }
}

/// Draws a frame, or its split view. Returns counts of what was drawn, and the largest error in 2^-16 texel:
/// 0 if the frame is not split.
fn paint(
    stage: &mut SceneRenderer<'_>,
    split: Option<&Split>,
    pose: &Pose,
    options: RenderOptions,
    destination: &mut impl Destination,
) -> (Drawn, u32) {
    match split {
        Some(split) => split.draw(stage, pose, options, destination),
        None => (stage.draw(pose, options, destination), 0),
    }
}

/// Returns the pose that a frame's name stands for, or `None` if its distance is outside the legal range.
pub fn pose(scene: &Entry<'_>, frame: FrameName) -> Option<Pose> {
    match frame {
        FrameName::Number(frame) => Some(scene.pose(frame)),
        FrameName::Pose {
            yaw,
            pitch,
            roll,
            distance,
        } => {
            let distance = i32::try_from(distance).ok()?;
            (distance <= Pose::MAX_DISTANCE).then_some(Pose {
                yaw,
                pitch,
                roll,
                distance,
            })
        }
    }
}

/// Returns the pose one tick after `pose`, or `None` if its distance is outside the legal range.
fn moved(pose: &Pose, motion: Motion) -> Option<Pose> {
    let distance = pose.distance.wrapping_add(motion.distance as i32);
    (0..=Pose::MAX_DISTANCE)
        .contains(&distance)
        .then_some(Pose {
            yaw: pose.yaw.wrapping_add(motion.yaw),
            pitch: pose.pitch.wrapping_add(motion.pitch),
            roll: pose.roll.wrapping_add(motion.roll),
            distance,
        })
}

/// Returns the motion from a pose to the pose of the next tick.
fn motion(pose: &Pose, next: &Pose) -> Motion {
    Motion {
        yaw: next.yaw.wrapping_sub(pose.yaw),
        pitch: next.pitch.wrapping_sub(pose.pitch),
        roll: next.roll.wrapping_sub(pose.roll),
        distance: next.distance.wrapping_sub(pose.distance) as u32,
    }
}

/// Reports an unknown name; the state did not change.
fn known(changed: Result<(), steering::Unknown>, change: Change, out: &mut Out<'_>) -> Option<()> {
    if let (Err(steering::Unknown), Change::Set(setting, name)) = (changed, change) {
        out(format_args!(
            "{ERROR} no {setting} '{name}'; '{setting}' alone lists them"
        ));
    }
    changed.ok()
}

/// Returns the name of a pose.
fn name(pose: &Pose) -> FrameName {
    FrameName::Pose {
        yaw: pose.yaw,
        pitch: pose.pitch,
        roll: pose.roll,
        distance: pose.distance.unsigned_abs(),
    }
}

/// Displays bytes in hex, separated by spaces.
struct Bytes<'a>(&'a [u8]);

impl fmt::Display for Bytes<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, byte) in self.0.iter().enumerate() {
            let space = if i == 0 { "" } else { " " };
            write!(f, "{space}{byte:02x}")?;
        }
        Ok(())
    }
}
