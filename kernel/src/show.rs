//! The program: pictures, one after the other, and answers to commands.
//!
//! Running, it draws the picture of each tick as long as the machine keeps up, and skips ticks
//! when it does not: the motion keeps its pace. Held, it draws what `show` names and touches no
//! video memory between commands, so that what is on the screen can be taken as evidence.

use link::{Command, ERROR, Lines, OK, RUNNING};
use modex::{Counted, ModeX, Readback};
use scene::{Pose, Stage, Storage, TEXELS};
use spin::Mutex;
use texmap::Stats;

use crate::line;
use crate::machine::{self, Machine, Window, serial, timer};

/// The fixed memory of the program.
struct Memory {
    texels: [u8; TEXELS],
    storage: Storage,
}

static MEMORY: Mutex<Memory> = Mutex::new(Memory {
    texels: [0; TEXELS],
    storage: Storage::new(),
});

/// Runs the show until the machine ends.
pub fn run(machine: Machine) -> ! {
    let memory = &mut *MEMORY.lock();
    let textures = [scene::paint_ball(&mut memory.texels)];
    let scene = scene::ball(&textures);
    let card = ModeX::set(Counted::new(machine.vga), scene.palette);
    let mut show = Show {
        card: set(card),
        stage: Stage::new(&mut memory.storage, scene),
        drawn: Stats::default(),
        pace: Some(Pace::default()),
    };
    let mut lines = Lines::new();
    loop {
        while let Some(byte) = serial::receive() {
            match lines.push(byte) {
                Some(Ok(line)) => show.obey(line),
                Some(Err(noise)) => line!("{ERROR} {noise}"),
                None => {}
            }
        }
        let tick = timer::ticks();
        if show.is_due(tick) {
            show.present(tick);
        } else {
            machine::sleep_while(|| timer::ticks() == tick && !serial::has_received());
        }
    }
}

/// A card that does not read back as it was set can't be drawn on.
fn set<T>(outcome: Result<T, Readback>) -> T {
    match outcome {
        Ok(card) => card,
        Err(readback) => panic!("Mode X is not set: {readback}"),
    }
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

struct Show<'a> {
    card: ModeX<Counted<Window>>,
    stage: Stage<'a>,
    /// What the last picture took.
    drawn: Stats,
    /// Nothing while the show is held.
    pace: Option<Pace>,
}

impl Show<'_> {
    /// Whether the show runs and the picture of `tick` is not on the screen yet.
    fn is_due(&self, tick: u32) -> bool {
        self.pace.is_some_and(|pace| pace.last != Some(tick))
    }

    /// The running show's picture for `tick`.
    fn present(&mut self, tick: u32) {
        self.draw(tick);
        self.card.flip();
        let Some(pace) = &mut self.pace else { return };
        let before = pace.last.replace(tick);
        pace.late += u32::from(before.is_some_and(|before| tick.wrapping_sub(before) > 1));
        pace.pictures = pace.pictures.wrapping_add(1);
        if before.is_none() {
            line!("{RUNNING}");
        }
    }

    /// Draws picture `frame` on the next page.
    fn draw(&mut self, frame: u32) {
        self.card.bus().take_counts();
        let mut canvas = self.card.begin(self.stage.scene().background);
        self.drawn = self.stage.draw(&Pose::at_tick(frame), &mut canvas);
    }

    /// Stops the show, the card as after the mode set: what follows depends on the commands
    /// alone, and not on how far the show had come.
    fn hold(&mut self) {
        self.pace = None;
        set(self.card.reset(self.stage.scene().palette));
    }

    fn obey(&mut self, line: &str) {
        let command = match Command::parse(line) {
            Ok(command) => command,
            Err(error) => return line!("{ERROR} {error}"),
        };
        match command {
            Command::Hold => self.hold(),
            Command::Run => self.pace = Some(Pace::default()),
            Command::Show(frame) => {
                if self.pace.is_some() {
                    self.hold();
                }
                self.draw(frame);
                self.card.flip();
                self.card.settle();
                line!("page {}", self.card.shown_page());
            }
            Command::Registers => self.tell_registers(),
            Command::Counts => self.tell_counts(),
            Command::Fail(fault) => machine::fail(fault),
            Command::Leave => {
                line!("{OK} {command}");
                machine::exit(link::Exit::Left);
            }
        }
        line!("{OK} {command}");
    }

    fn tell_registers(&mut self) {
        let mode = self.card.registers();
        for (block, registers) in mode.blocks() {
            line!("{block} {}", Bytes(registers));
        }
    }

    fn tell_counts(&mut self) {
        let Stats {
            polygons,
            columns,
            pixels,
            dropped,
            full,
        } = self.drawn;
        line!(
            "picture polygons {polygons} columns {columns} pixels {pixels} dropped {dropped} full {full}"
        );
        for (purpose, tally) in self.card.bus().counts().named() {
            let modex::Tally {
                ports,
                map_mask,
                stores,
                bytes,
            } = tally;
            line!("{purpose} ports {ports} map-mask {map_mask} stores {stores} bytes {bytes}");
        }
        if let Some(Pace { pictures, late, .. }) = self.pace {
            line!(
                "pace pictures {pictures} late {late} tick {}",
                timer::ticks()
            );
        }
    }
}

/// Bytes in hex, a space between.
struct Bytes<'a>(&'a [u8]);

impl core::fmt::Display for Bytes<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        for (i, byte) in self.0.iter().enumerate() {
            let space = if i == 0 { "" } else { " " };
            write!(f, "{space}{byte:02x}")?;
        }
        Ok(())
    }
}
