//! The bench: a card, a scene, pages in RAM, and the work that is measured on them.

use core::fmt;
use core::hint::black_box;

use link::{Checksum, ERROR, Lines, OK};
use modex::{Bus, Destination, HEIGHT, ModeX, Offscreen, PlanarBuffer, SetError, WIDTH};
use scene::{Pose, Stage, Storage};
use texmap::{Job, JobList, Mapper, Order, Stats, Texture};

use crate::line::{Ask, Figure};
use crate::screen::{self, Screen};
use crate::work::{Place, Work};

/// The ball's frame that is measured.
pub const FRAME: u32 = 480;
/// Lengths of runs that are measured by themselves. None is longer than a column.
pub const LENGTHS: [u16; 16] = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 240];

/// Jobs of the screen's face: a run for each line, and room for mappers that cut theirs, into pieces
/// of ten pixels and more.
const MAX_JOBS: usize = 8192;
/// What the bare loops store.
const BARE: u8 = 0x55;
/// Instructions that the clock is compared with.
const KNOWN: u32 = 4_000_000;

/// Where an answer's lines go, each without its checksum.
pub type Out<'a> = dyn FnMut(fmt::Arguments<'_>) + 'a;

/// What tells how long work takes.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    /// The time, in ticks. No memory access may be moved across it.
    pub now: fn() -> u64,
    /// Carries out as many instructions.
    pub instructions: fn(u32),
    /// Whether the CPU has the bit-extract instruction (BMI2).
    pub bmi2: bool,
}

/// The fixed memory of the bench, zeros at first. About 2.5 MiB: meant for a static, which then takes
/// no room in an image.
#[derive(Clone, Copy, Debug)]
pub struct Memory {
    ball: [u8; scene::TEXELS],
    storage: Storage,
    square: [u8; screen::TEXELS],
    jobs: JobList<MAX_JOBS>,
    page: PlanarBuffer,
    offscreen: Offscreen,
}

impl Memory {
    /// Empty.
    pub const fn new() -> Self {
        Self {
            ball: [0; scene::TEXELS],
            storage: Storage::new(),
            square: [0; screen::TEXELS],
            jobs: JobList::new(),
            page: PlanarBuffer::new(),
            offscreen: Offscreen::new(),
        }
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

/// Everything that work needs, prepared.
#[derive(Debug)]
pub struct Bench<'a, B> {
    card: ModeX<B>,
    stage: Stage<'a>,
    pose: Pose,
    /// The ball's texture in full light: of a texture job making reads the sides, and those are the
    /// same in every light.
    ball: Texture<'a>,
    screen: Screen,
    square: [Texture<'a>; 1],
    jobs: &'a mut JobList<MAX_JOBS>,
    page: &'a mut PlanarBuffer,
    offscreen: &'a mut Offscreen,
    lines: Lines,
}

impl<'a, B: Bus> Bench<'a, B> {
    /// Paints the textures into `memory` and sets the card's mode.
    ///
    /// # Errors
    /// As [`ModeX::set`].
    pub fn new(memory: &'a mut Memory, bus: B) -> Result<Self, SetError> {
        let ball = [scene::paint_ball(&mut memory.ball)];
        let stage = Stage::new(&mut memory.storage, scene::ball(&ball));
        let card = ModeX::set(bus, stage.palette())?;
        Ok(Self {
            card,
            stage,
            pose: Pose::at_tick(FRAME),
            ball: ball[0],
            screen: Screen::new(),
            square: [screen::paint(&mut memory.square)],
            jobs: &mut memory.jobs,
            page: &mut memory.page,
            offscreen: &mut memory.offscreen,
            lines: Lines::new(),
        })
    }

    /// The card's bus.
    pub fn bus(&mut self) -> &mut B {
        self.card.bus()
    }

    /// Says that bytes of the serial line may be missing before the next one, or that the next one
    /// is damaged: its line is refused ([`Lines::damage`]).
    pub fn damage(&mut self) {
        self.lines.damage();
    }

    /// Takes a byte of the serial line; with the one that ends a line, answers it. True when it
    /// asked to leave.
    pub fn receive(&mut self, byte: u8, clock: &Clock, out: &mut Out<'_>) -> bool {
        let ask = match self.lines.push(byte) {
            None => return false,
            Some(Ok(line)) => Ask::parse(line),
            Some(Err(noise)) => {
                out(format_args!("{ERROR} {noise}"));
                return false;
            }
        };
        match ask {
            Ok(ask) => {
                self.answer(ask, clock, out);
                ask == Ask::Leave
            }
            Err(error) => {
                out(format_args!("{ERROR} {error}"));
                false
            }
        }
    }

    /// Measures what is asked for, and then tells it.
    pub fn answer(&mut self, ask: Ask, clock: &Clock, out: &mut Out<'_>) {
        match ask {
            Ask::Calibrate => {
                let took = |count| ticks(clock.now, &mut || (clock.instructions)(count));
                // A warm-up, and the call itself taken off.
                took(KNOWN);
                let [more, less] = [2 * KNOWN, KNOWN].map(took);
                out(format_args!(
                    "instructions {KNOWN} ticks {}",
                    more.saturating_sub(less)
                ));
                let bmi2 = if clock.bmi2 { "yes" } else { "no" };
                out(format_args!("bmi2 {bmi2}"));
            }
            Ask::Measure(mapper, order, rounds) => {
                self.set(mapper, order);
                let figures = self.measure(rounds, clock.now);
                for ((name, _), figure) in Work::ALL.iter().zip(figures) {
                    out(format_args!("{name} {figure}"));
                }
            }
            Ask::Runs(mapper, order, rounds) => {
                self.set(mapper, order);
                let figures = LENGTHS.map(|length| self.runs(length, rounds, clock.now));
                for (length, [jobs, draw]) in LENGTHS.iter().zip(figures) {
                    out(format_args!("run-{length}-jobs {jobs}"));
                    out(format_args!("run-{length}-draw {draw}"));
                }
            }
            Ask::Check(mapper, order) => {
                self.set(mapper, order);
                for (name, work) in Work::ALL {
                    self.prepare(work);
                    self.run(work, || 0);
                    if let Some(sum) = self.checksum(work.place()) {
                        out(format_args!("{name} crc {sum:08x}"));
                    }
                }
            }
            Ask::Leave => {}
        }
        out(format_args!("{OK} {ask}"));
    }

    /// Has the next work done by a mapper in an order.
    pub fn set(&mut self, mapper: Mapper, order: Order) {
        self.stage.set_mapper(mapper);
        self.stage.set_order(order);
    }

    /// What is done once before a work: afterwards it takes the same each time.
    pub fn prepare(&mut self, work: Work) {
        match work {
            Work::ScreenRam | Work::ScreenCard => self.make_screen_jobs(),
            // Before it the card's pages may hold anything. With the ball on each of them every
            // picture erases and presents what the one before left.
            Work::Present => {
                let background = self.stage.background();
                for _ in 0..modex::PAGES {
                    self.offscreen.begin(background);
                    self.stage.draw(&self.pose, self.offscreen);
                    self.card.present(self.offscreen);
                    self.card.flip();
                }
            }
            _ => {}
        }
    }

    /// Does a work, and returns the ticks that it took.
    ///
    /// # Panics
    /// If the mapper drops a face.
    pub fn run(&mut self, work: Work, now: fn() -> u64) -> u64 {
        let (mapper, order) = (self.stage.mapper(), self.stage.order());
        let background = self.stage.background();
        let mut stats = Stats::default();
        let ticks = match work {
            Work::BareRam => ticks(now, &mut || bare(self.page)),
            Work::BareCard => {
                let mut canvas = self.card.begin(background);
                let ticks = ticks(now, &mut || bare(&mut canvas));
                self.card.flip();
                ticks
            }
            Work::ScreenJobs => ticks(now, &mut || self.make_screen_jobs()),
            Work::ScreenRam => ticks(now, &mut || {
                order.draw(self.jobs, &self.square, self.page, mapper);
            }),
            Work::ScreenCard => {
                let mut canvas = self.card.begin(background);
                let ticks = ticks(now, &mut || {
                    order.draw(self.jobs, &self.square, &mut canvas, mapper);
                });
                self.card.flip();
                ticks
            }
            Work::Present => (0..work.pictures())
                .map(|_| {
                    let ticks = ticks(now, &mut || self.card.present(self.offscreen));
                    self.card.flip();
                    ticks
                })
                .sum(),
            Work::FrameCard => ticks(now, &mut || {
                for _ in 0..work.pictures() {
                    let mut canvas = self.card.begin(background);
                    stats = self.stage.draw(&self.pose, &mut canvas);
                    self.card.flip();
                }
            }),
            Work::FrameFaces => ticks(now, &mut || {
                self.stage.polygons(&self.pose, |_, face| {
                    black_box(&face);
                });
            }),
            Work::FrameJobs => ticks(now, &mut || {
                self.stage.polygons(&self.pose, |_, face| {
                    let made = face.map(|face| {
                        mapper.jobs(&face, &self.ball, |job| {
                            black_box(&job);
                        })
                    });
                    stats.dropped += u32::from(made != Some(Ok(())));
                });
            }),
            Work::FrameDrawCard => {
                let mut canvas = self.card.begin(background);
                let ticks = ticks(now, &mut || {
                    stats = self.stage.draw(&self.pose, &mut canvas);
                });
                self.card.flip();
                ticks
            }
            Work::FrameDrawRam => {
                self.offscreen.begin(background);
                ticks(now, &mut || {
                    stats = self.stage.draw(&self.pose, self.offscreen);
                })
            }
            Work::FramePresented => ticks(now, &mut || {
                for _ in 0..work.pictures() {
                    self.offscreen.begin(background);
                    stats = self.stage.draw(&self.pose, self.offscreen);
                    self.card.present(self.offscreen);
                    self.card.flip();
                }
            }),
        };
        assert_eq!(stats.dropped, 0, "{mapper} dropped faces in '{work}'");
        ticks
    }

    /// Each work in rounds, the works of a round one after the other: what drifts on the host does
    /// so for all of them. A first round is not told.
    fn measure(&mut self, rounds: usize, now: fn() -> u64) -> [Figure; Work::ALL.len()] {
        let ball = self.pixels_of_the_ball();
        let mut figures = Work::ALL.map(|(_, work)| {
            let pixels = if work.is_of_the_ball() {
                ball
            } else {
                WIDTH * HEIGHT
            };
            Figure::new(pixels as u64 * u64::from(work.pictures()))
        });
        for round in 0..=rounds {
            for (figure, (_, work)) in figures.iter_mut().zip(Work::ALL) {
                self.prepare(work);
                let pair = ticks(now, &mut || ());
                let ticks = self.run(work, now).saturating_sub(pair * pairs(work));
                if round > 0 {
                    figure.add(ticks);
                }
            }
        }
        figures
    }

    /// Making the jobs of a face whose runs are all `length` pixels long, and drawing them in RAM.
    fn runs(&mut self, length: u16, rounds: usize, now: fn() -> u64) -> [Figure; 2] {
        let (mapper, order) = (self.stage.mapper(), self.stage.order());
        let Self {
            screen,
            square,
            jobs,
            page,
            ..
        } = self;
        let columns = screen.part(WIDTH as u16, length);
        make_jobs(&columns, mapper, square, jobs);
        let by_columns = jobs.jobs().iter().all(|job| job.len == length);
        let rows = screen.part(length, HEIGHT as u16);
        let face = if by_columns { columns } else { rows };
        make_jobs(&face, mapper, square, jobs);
        let mut figures = [Figure::new(pixels(jobs.jobs())); 2];
        for round in 0..=rounds {
            let pair = ticks(now, &mut || ());
            let took = [
                ticks(now, &mut || make_jobs(&face, mapper, square, jobs)),
                ticks(now, &mut || {
                    order.draw(jobs, &square[..], *page, mapper);
                }),
            ];
            for (figure, took) in figures.iter_mut().zip(took) {
                if round > 0 {
                    figure.add(took.saturating_sub(pair));
                }
            }
        }
        figures
    }

    fn make_screen_jobs(&mut self) {
        let mapper = self.stage.mapper();
        make_jobs(&self.screen, mapper, &self.square, self.jobs);
    }

    fn pixels_of_the_ball(&mut self) -> usize {
        self.offscreen.begin(self.stage.background());
        self.stage.draw(&self.pose, self.offscreen).pixels as usize
    }

    /// The CRC-32 of the picture at a place, pixel by pixel from the top left.
    fn checksum(&mut self, place: Place) -> Option<u32> {
        let mut sum = Checksum::new();
        for y in 0..HEIGHT {
            let mut row = [0; WIDTH];
            match place {
                Place::Nowhere => return None,
                Place::Page => row = core::array::from_fn(|x| self.page.pixel(x, y)),
                Place::Offscreen => {
                    row = core::array::from_fn(|x| self.offscreen.page().pixel(x, y));
                }
                Place::Card => {
                    let at = usize::from(self.card.start_address()) + y * modex::STRIDE;
                    self.card.load(at as u16, &mut row);
                }
            }
            sum.add(&row);
        }
        Some(sum.value())
    }
}

/// Reads of the clock, in pairs, that a work's ticks have in them.
fn pairs(work: Work) -> u64 {
    match work {
        Work::Present => u64::from(work.pictures()),
        _ => 1,
    }
}

/// Ticks from before the work to after it, a pair of reads included. Never inlined, and the work
/// not known: it is the same two calls around every work.
#[inline(never)]
fn ticks(now: fn() -> u64, work: &mut dyn FnMut()) -> u64 {
    let work = black_box(work);
    let before = now();
    work();
    now().wrapping_sub(before)
}

/// Fills the screen with one colour, column by column.
fn bare(destination: &mut impl Destination) {
    for x in 0..WIDTH as u16 {
        destination.column(x, 0, HEIGHT as u16, |column| column.fill(|| BARE));
    }
}

fn make_jobs(
    screen: &Screen,
    mapper: Mapper,
    textures: &[Texture<'_>],
    jobs: &mut JobList<MAX_JOBS>,
) {
    jobs.clear();
    let face = screen.face();
    let made = mapper.jobs(black_box(&face), &textures[0], |job| {
        jobs.push(job)
            .expect("the list has room for a screen's jobs");
    });
    assert_eq!(made, Ok(()), "{mapper} does not take the screen's face");
}

fn pixels(jobs: &[Job]) -> u64 {
    jobs.iter().map(|job| u64::from(job.len)).sum()
}
