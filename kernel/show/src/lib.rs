//! The program: pictures, one after the other, and answers to commands.
//!
//! Running, it draws the picture of each tick as long as the machine keeps up, and skips ticks
//! when it does not: the motion keeps its pace. Held, it draws what `show` names and touches no
//! video memory between commands, so that what is on the screen can be taken as evidence.
//!
//! It knows nothing of the machine: a card behind a [`modex::Bus`], bytes in, lines out, and the
//! tick as an argument. The kernel gives it the bare machine's card and its serial line, a test
//! the emulated card and a list; the same commands then bring the same answers.
#![no_std]
#![forbid(unsafe_code)]

use core::fmt;

use link::dump::{self, Header};
use link::{Command, Content, ERROR, Fault, Lines, OK, PROTOCOL, Picture, RUNNING, Setting, Word};
use modex::{Bus, Counted, HEIGHT, ModeX, Offscreen, Readback, Tally, WIDTH};
use pack::{Arena, Pack};
use scene::catalogue::{CATALOGUE, Entry, MAX_TEXELS};
use scene::{Pose, Stage, Storage};
use texmap::{Mapper, Order, Stats};

/// The program's version, as its first line and `version` tell it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Where an answer's lines go, each without its checksum.
pub type Out<'a> = dyn FnMut(fmt::Arguments<'_>) + 'a;

/// The fixed memory of the program. About 2.5 MiB: meant for a static.
#[derive(Debug)]
pub struct Memory {
    model: Arena,
    texels: [u8; MAX_TEXELS],
    storage: Storage,
    offscreen: Offscreen,
}

impl Memory {
    /// Empty.
    pub const fn new() -> Self {
        Self {
            model: Arena::new(),
            texels: [0; MAX_TEXELS],
            storage: Storage::new(),
            offscreen: Offscreen::new(),
        }
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

/// What only the machine can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Break in this way.
    Fail(Fault),
    /// End, as asked to.
    Leave,
}

/// How the running show keeps up with the ticks.
#[derive(Clone, Copy, Debug, Default)]
struct Pace {
    /// The tick of the last picture.
    last: Option<u32>,
    /// Pictures shown.
    pictures: u32,
    /// Pictures that came more than a tick after the one before.
    late: u32,
}

/// A card, and the scene that is shown on it.
#[derive(Debug)]
pub struct Show<'a, B> {
    card: ModeX<Counted<B>>,
    /// The model that was loaded, and its pack's checksum.
    model: Option<(Entry<'a>, u32)>,
    /// The scene on the stage, and where its texture is painted.
    entry: Entry<'a>,
    texels: &'a mut [u8; MAX_TEXELS],
    stage: Stage<'a>,
    offscreen: &'a mut Offscreen,
    lines: Lines,
    /// The last picture, by which mapper it was drawn, and what it took.
    picture: Option<Picture>,
    mapper: Mapper,
    drawn: Stats,
    /// Nothing while the show is held.
    pace: Option<Pace>,
}

impl<'a, B: Bus> Show<'a, B> {
    /// Paints the default scene into `memory` and sets the card's mode. The show runs. With a
    /// `pack` its model is a scene beside the built-in ones, and the default; otherwise the ball is.
    ///
    /// # Panics
    /// If the card does not read back as it was set: it can't be drawn on.
    pub fn new(memory: &'a mut Memory, bus: B, pack: Option<&Pack<'a>>) -> Self {
        let arena = &mut memory.model;
        let model = pack.map(|pack| (pack.entry(arena), pack.checksum()));
        let entry = default_scene(model);
        let textures = [entry.paint(&mut memory.texels)];
        let stage = Stage::new(&mut memory.storage, entry.scene(&textures));
        Self {
            model,
            entry,
            texels: &mut memory.texels,
            card: expect(ModeX::set(Counted::new(bus), stage.palette())),
            stage,
            offscreen: &mut memory.offscreen,
            lines: Lines::new(),
            picture: None,
            mapper: Mapper::default(),
            drawn: Stats::default(),
            pace: Some(Pace::default()),
        }
    }

    /// The card.
    pub fn bus(&mut self) -> &mut B {
        self.card.bus().inner()
    }

    /// Whether the show runs and the picture of `tick` is not on the screen yet.
    pub fn is_due(&self, tick: u32) -> bool {
        self.pace.is_some_and(|pace| pace.last != Some(tick))
    }

    /// Shows the running show's picture of `tick`.
    pub fn present(&mut self, tick: u32, out: &mut Out<'_>) {
        self.draw(Picture::Frame(tick), &self.entry.pose(tick));
        let Some(pace) = &mut self.pace else { return };
        let before = pace.last.replace(tick);
        pace.late += u32::from(before.is_some_and(|before| tick.wrapping_sub(before) > 1));
        pace.pictures = pace.pictures.wrapping_add(1);
        if before.is_none() {
            out(format_args!("{RUNNING}"));
        }
    }

    /// Takes a byte of the serial line; with the one that ends a line, obeys it.
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

    /// Carries a command out and answers it.
    pub fn obey(&mut self, command: Command, tick: u32, out: &mut Out<'_>) -> Option<Request> {
        match command {
            Command::Hold => {
                self.stage.set_mapper(Mapper::default());
                self.stage.set_order(Order::default());
                self.set_scene(default_scene(self.model));
                self.hold();
            }
            Command::Run => self.pace = Some(Pace::default()),
            Command::Show(picture) => {
                let Some(pose) = pose(&self.entry, picture) else {
                    let most = Pose::MAX_DISTANCE;
                    out(format_args!("{ERROR} a distance is 0 to {most:08x}"));
                    return None;
                };
                if self.pace.is_some() {
                    self.hold();
                }
                self.draw(picture, &pose);
                self.card.settle();
                out(format_args!("page {}", self.card.shown_page()));
            }
            Command::Set(setting, None) => self.list(setting, out),
            Command::Set(setting, Some(name)) => {
                if self.set(setting, &name).is_none() {
                    out(format_args!(
                        "{ERROR} no {setting} '{name}'; '{setting}' alone lists them"
                    ));
                    return None;
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

    /// Draws a picture on the next page, and flips.
    fn draw(&mut self, picture: Picture, pose: &Pose) {
        self.card.bus().take_counts();
        let background = self.stage.background();
        self.drawn = match self.stage.order() {
            Order::Polygons | Order::Planes => {
                self.stage.draw(pose, &mut self.card.begin(background))
            }
            Order::Buffer => {
                self.offscreen.begin(background);
                let drawn = self.stage.draw(pose, self.offscreen);
                self.card.present(self.offscreen);
                drawn
            }
        };
        self.card.flip();
        self.picture = Some(picture);
        self.mapper = self.stage.mapper();
    }

    /// Sets something by name; nothing if there is no such name.
    fn set(&mut self, setting: Setting, name: &Word) -> Option<()> {
        match setting {
            Setting::Scene => {
                let named = self.scenes().find(|entry| entry.name == name.as_str())?;
                self.set_scene(named);
                self.reset();
            }
            Setting::Mapper => self.stage.set_mapper(Mapper::parse(name.as_str())?),
            Setting::Order => self.stage.set_order(Order::parse(name.as_str())?),
        }
        Some(())
    }

    /// Every scene that can be set.
    fn scenes(&self) -> impl Iterator<Item = Entry<'a>> + use<'a, B> {
        let model = self.model.map(|(entry, _)| entry);
        CATALOGUE.iter().copied().chain(model)
    }

    /// Puts a scene on the stage; the card has to be reset then, for its palette and background.
    fn set_scene(&mut self, entry: Entry<'a>) {
        if entry.name != self.entry.name {
            self.entry = entry;
            let textures = [entry.paint(self.texels)];
            self.stage.set(entry.scene(&textures));
            self.offscreen.forget();
        }
    }

    /// Tells what a setting can be set to.
    fn list(&self, setting: Setting, out: &mut Out<'_>) {
        let mut tell = |set: bool, name: &str, about: &str| {
            let mark = if set { "*" } else { "" };
            out(format_args!("{mark}{name} {about}"));
        };
        match setting {
            Setting::Scene => {
                for entry in self.scenes() {
                    tell(entry.name == self.entry.name, entry.name, entry.about);
                }
            }
            Setting::Mapper => {
                for &(name, mapper, about) in Mapper::ALL {
                    tell(mapper == self.stage.mapper(), name, about);
                }
                let set = self.stage.mapper();
                if set.name().is_empty() {
                    out(format_args!("*{set} as within-1, with another tolerance"));
                }
            }
            Setting::Order => {
                for (name, order, about) in Order::ALL {
                    tell(order == self.stage.order(), name, about);
                }
            }
        }
    }

    /// Stops the show, the card as after the mode set: what follows depends on the commands
    /// alone, and not on how far the show had come.
    fn hold(&mut self) {
        self.pace = None;
        self.reset();
    }

    /// Sets the card anew: no picture is on it.
    fn reset(&mut self) {
        self.picture = None;
        expect(self.card.reset(self.stage.palette()));
    }

    fn header(&self, content: Content) -> Header<&'static str> {
        Header {
            content,
            scene: self.stage.name(),
            pack: self
                .model
                .filter(|(entry, _)| entry.name == self.stage.name())
                .map(|(_, checksum)| checksum),
            mapper: Word::of(self.mapper).expect("a mapper's name is a word"),
            picture: self.picture,
            start: self.card.start_address(),
            width: WIDTH as u16,
            height: HEIGHT as u16,
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
        } = self.drawn;
        out(format_args!(
            "picture polygons {polygons} columns {columns} pixels {pixels} dropped {dropped} full {full}"
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
        if let Some(Pace { pictures, late, .. }) = self.pace {
            out(format_args!(
                "pace pictures {pictures} late {late} tick {tick}"
            ));
        }
    }

    fn tell_state(&mut self, tick: u32, out: &mut Out<'_>) {
        match self.pace {
            Some(_) => out(format_args!("running tick {tick}")),
            None => out(format_args!("held")),
        }
        out(format_args!("scene {}", self.stage.name()));
        out(format_args!("mapper {}", self.stage.mapper()));
        out(format_args!("order {}", self.stage.order()));
        match self.picture {
            Some(picture) => out(format_args!("picture {picture}")),
            None => out(format_args!("picture none")),
        }
        out(format_args!(
            "page {} start {:04x}",
            self.card.shown_page(),
            self.card.start_address()
        ));
    }
}

/// The scene of a show that was not told another one.
fn default_scene<'a>(model: Option<(Entry<'a>, u32)>) -> Entry<'a> {
    model.map_or(CATALOGUE[0], |(entry, _)| entry)
}

/// The pose of a scene's picture; none if it is outside the legal range.
pub fn pose(scene: &Entry<'_>, picture: Picture) -> Option<Pose> {
    match picture {
        Picture::Frame(frame) => Some(scene.pose(frame)),
        Picture::Pose {
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

fn expect<T>(outcome: Result<T, Readback>) -> T {
    match outcome {
        Ok(card) => card,
        Err(readback) => panic!("Mode X is not set: {readback}"),
    }
}

/// Bytes in hex, a space between.
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
