//! The bench: a card, a scene and pages in RAM, and the measured work on them.

use core::fmt;
use core::hint::black_box;

use modex::{Bus, Destination, HEIGHT, ModeX, Offscreen, PlanarBuffer, SetError, WIDTH};
use protocol::{Checksum, ERROR, Lines, OK};
use render::{RenderMemory, RenderOptions, SceneRenderer};
use scene::Pose;
use texmap::{Job, JobList, Mapper, Order, Stats, Texture};

use crate::request::{BenchRequest, Figure};
use crate::screen::{self, Screen};
use crate::work::{Target, Work};

/// The measured frame of the scene `ball`.
pub const FRAME: u32 = 480;
/// Lengths of spans that are measured separately. The longest is a column.
pub const LENGTHS: [u16; 16] = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 240];

/// Jobs of the face that fills the screen: a span for each line, and space for mappers that cut spans into
/// pieces of ten or more pixels.
const MAX_JOBS: usize = 8192;
/// The value that the bare loops store.
const BARE: u8 = 0x55;
/// The number of instructions that calibrate the clock.
const KNOWN: u32 = 4_000_000;

/// A sink for an answer's lines, each without its checksum.
pub type Out<'a> = dyn FnMut(fmt::Arguments<'_>) + 'a;

/// The clock that measures the work, and the features of the CPU.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    /// Returns the time in ticks. The compiler must move no memory access across a call.
    pub now: fn() -> u64,
    /// Carries out the given number of instructions.
    pub instructions: fn(u32),
    /// Whether the CPU has the bit-extract instruction (BMI2).
    pub bmi2: bool,
}

/// The fixed memory of the bench, about 3.5 MiB. It is zero at first and meant for a static, which then
/// occupies no space in an image.
#[derive(Clone, Copy, Debug)]
pub struct BenchMemory {
    ball: [u8; scene::TEXELS],
    render: RenderMemory,
    square: [u8; screen::TEXELS],
    jobs: JobList<MAX_JOBS>,
    page: PlanarBuffer,
    offscreen: Offscreen,
}

impl BenchMemory {
    /// Returns empty memory.
    pub const fn new() -> Self {
        Self {
            ball: [0; scene::TEXELS],
            render: RenderMemory::new(),
            square: [0; screen::TEXELS],
            jobs: JobList::new(),
            page: PlanarBuffer::new(),
            offscreen: Offscreen::new(),
        }
    }
}

impl Default for BenchMemory {
    fn default() -> Self {
        Self::new()
    }
}

/// Everything that the work needs, prepared.
#[derive(Debug)]
pub struct Bench<'a, B> {
    card: ModeX<B>,
    renderer: SceneRenderer<'a>,
    /// The mapper and the order of the work.
    options: RenderOptions,
    pose: Pose,
    /// The ball's texture in full light. Making jobs reads only a texture's sides, which are the same in
    /// every light.
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
    pub fn new(memory: &'a mut BenchMemory, bus: B) -> Result<Self, SetError> {
        let ball = [scene::paint_ball(&mut memory.ball)];
        let renderer = SceneRenderer::new(&mut memory.render, scene::ball(&ball));
        let card = ModeX::set(bus, renderer.palette())?;
        Ok(Self {
            card,
            renderer,
            options: RenderOptions::default(),
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

    /// Returns the card's bus.
    pub fn bus(&mut self) -> &mut B {
        self.card.bus()
    }

    /// Marks the serial line as damaged: bytes before the next byte may be missing, or the next byte arrived
    /// damaged. The line of the next byte is refused ([`Lines::damage`]).
    pub fn damage(&mut self) {
        self.lines.damage();
    }

    /// Handles a byte from the serial line. If the byte ends a line, answers the line. Returns true if the
    /// line was `leave`.
    pub fn receive(&mut self, byte: u8, clock: &Clock, out: &mut Out<'_>) -> bool {
        let request = match self.lines.push(byte) {
            None => return false,
            Some(Ok(line)) => BenchRequest::parse(line),
            Some(Err(noise)) => {
                out(format_args!("{ERROR} {noise}"));
                return false;
            }
        };
        match request {
            Ok(request) => {
                self.answer(request, clock, out);
                request == BenchRequest::Leave
            }
            Err(error) => {
                out(format_args!("{ERROR} {error}"));
                false
            }
        }
    }

    /// Carries out a request, and then writes its answer.
    pub fn answer(&mut self, request: BenchRequest, clock: &Clock, out: &mut Out<'_>) {
        match request {
            BenchRequest::Calibrate => {
                let measure = |count| ticks(clock.now, &mut || (clock.instructions)(count));
                // The first call is a warm-up. The difference of two counts cancels the cost of the call.
                measure(KNOWN);
                let [more, less] = [2 * KNOWN, KNOWN].map(measure);
                out(format_args!(
                    "instructions {KNOWN} ticks {}",
                    more.saturating_sub(less)
                ));
                let bmi2 = if clock.bmi2 { "yes" } else { "no" };
                out(format_args!("bmi2 {bmi2}"));
            }
            BenchRequest::Measure(mapper, order, rounds) => {
                self.set(mapper, order);
                let figures = self.measure_work(rounds, clock.now);
                for (work, figure) in Work::ALL.iter().zip(figures) {
                    out(format_args!("{work} {figure}"));
                }
            }
            BenchRequest::Spans(mapper, order, rounds) => {
                self.set(mapper, order);
                let figures = LENGTHS.map(|length| self.measure_spans(length, rounds, clock.now));
                for (length, [jobs, draw]) in LENGTHS.iter().zip(figures) {
                    out(format_args!("span-{length}-jobs {jobs}"));
                    out(format_args!("span-{length}-draw {draw}"));
                }
            }
            BenchRequest::Check(mapper, order) => {
                self.set(mapper, order);
                for &work in Work::ALL {
                    self.prepare(work);
                    self.run(work, || 0);
                    if let Some(sum) = self.checksum(work.target()) {
                        out(format_args!("{work} crc {sum:08x}"));
                    }
                }
            }
            BenchRequest::Leave => {}
        }
        out(format_args!("{OK} {request}"));
    }

    /// Sets the mapper and the order of the work that follows.
    pub fn set(&mut self, mapper: Mapper, order: Order) {
        self.options = RenderOptions {
            mapper,
            order,
            next: None,
        };
    }

    /// Prepares a piece of work, so that each repetition is the same.
    pub fn prepare(&mut self, work: Work) {
        match work {
            Work::ScreenRam | Work::ScreenCard => self.make_screen_jobs(),
            // The card's pages may hold anything at first. With the ball on every page, each frame erases and
            // presents what the frame before it left.
            Work::Present => {
                let background = self.renderer.background();
                for _ in 0..modex::PAGES {
                    self.offscreen.begin(background);
                    self.renderer.draw(&self.pose, self.options, self.offscreen);
                    self.card.present(self.offscreen);
                    self.card.flip();
                }
            }
            _ => {}
        }
    }

    /// Does a piece of work, and returns how many ticks it lasted.
    ///
    /// # Panics
    /// If the mapper drops a face.
    pub fn run(&mut self, work: Work, now: fn() -> u64) -> u64 {
        let RenderOptions { mapper, order, .. } = self.options;
        let background = self.renderer.background();
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
            Work::Present => (0..work.frames())
                .map(|_| {
                    let ticks = ticks(now, &mut || self.card.present(self.offscreen));
                    self.card.flip();
                    ticks
                })
                .sum(),
            Work::FrameCard => ticks(now, &mut || {
                for _ in 0..work.frames() {
                    let mut canvas = self.card.begin(background);
                    stats = self
                        .renderer
                        .draw(&self.pose, self.options, &mut canvas)
                        .stats;
                    self.card.flip();
                }
            }),
            Work::FrameFaces => ticks(now, &mut || {
                self.renderer.at(&self.pose).faces(|_, face| {
                    black_box(&face);
                });
            }),
            Work::FrameJobs => ticks(now, &mut || {
                self.renderer.at(&self.pose).faces(|_, face| {
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
                    stats = self
                        .renderer
                        .draw(&self.pose, self.options, &mut canvas)
                        .stats;
                });
                self.card.flip();
                ticks
            }
            Work::FrameDrawRam => {
                self.offscreen.begin(background);
                ticks(now, &mut || {
                    stats = self
                        .renderer
                        .draw(&self.pose, self.options, self.offscreen)
                        .stats;
                })
            }
            Work::FramePresented => ticks(now, &mut || {
                for _ in 0..work.frames() {
                    self.offscreen.begin(background);
                    stats = self
                        .renderer
                        .draw(&self.pose, self.options, self.offscreen)
                        .stats;
                    self.card.present(self.offscreen);
                    self.card.flip();
                }
            }),
        };
        assert_eq!(stats.dropped, 0, "{mapper} dropped faces in '{work}'");
        ticks
    }

    /// Measures every piece of work once in each round, one after the other, so that a drift of the host
    /// affects all of them alike. The first round is a warm-up and is not counted.
    fn measure_work(&mut self, rounds: usize, now: fn() -> u64) -> [Figure; Work::ALL.len()] {
        let ball = self.pixels_of_the_ball();
        let mut figures = core::array::from_fn(|i| {
            let work = Work::ALL[i];
            let pixels = if work.is_of_the_ball() {
                ball
            } else {
                WIDTH * HEIGHT
            };
            Figure::new(pixels as u64 * u64::from(work.frames()))
        });
        for round in 0..=rounds {
            for (figure, &work) in figures.iter_mut().zip(Work::ALL) {
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

    /// Measures a face whose spans are all `length` pixels long: making its jobs, and drawing them in RAM.
    fn measure_spans(&mut self, length: u16, rounds: usize, now: fn() -> u64) -> [Figure; 2] {
        let RenderOptions { mapper, order, .. } = self.options;
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
            let measured = [
                ticks(now, &mut || make_jobs(&face, mapper, square, jobs)),
                ticks(now, &mut || {
                    order.draw(jobs, &square[..], *page, mapper);
                }),
            ];
            for (figure, ticks) in figures.iter_mut().zip(measured) {
                if round > 0 {
                    figure.add(ticks.saturating_sub(pair));
                }
            }
        }
        figures
    }

    fn make_screen_jobs(&mut self) {
        let mapper = self.options.mapper;
        make_jobs(&self.screen, mapper, &self.square, self.jobs);
    }

    fn pixels_of_the_ball(&mut self) -> usize {
        self.offscreen.begin(self.renderer.background());
        self.renderer
            .draw(&self.pose, self.options, self.offscreen)
            .stats
            .pixels as usize
    }

    /// Returns the CRC-32 of the frame in a target, pixel by pixel from the top left.
    fn checksum(&mut self, target: Target) -> Option<u32> {
        let mut sum = Checksum::new();
        for y in 0..HEIGHT {
            let mut row = [0; WIDTH];
            match target {
                Target::Nothing => return None,
                Target::Page => row = core::array::from_fn(|x| self.page.pixel(x, y)),
                Target::Offscreen => {
                    row = core::array::from_fn(|x| self.offscreen.page().pixel(x, y));
                }
                Target::Card => {
                    let at = usize::from(self.card.start_address()) + y * modex::STRIDE;
                    self.card.load(at as u16, &mut row);
                }
            }
            sum.add(&row);
        }
        Some(sum.value())
    }
}

/// Returns how many pairs of clock reads the ticks of a piece of work include.
fn pairs(work: Work) -> u64 {
    match work {
        Work::Present => u64::from(work.frames()),
        _ => 1,
    }
}

/// Returns the ticks from before the work to after it, including a pair of clock reads. The function is never
/// inlined, and the compiler does not know the work, so the same two calls surround every piece of work.
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
    assert_eq!(
        made,
        Ok(()),
        "{mapper} dropped the face that fills the screen"
    );
}

fn pixels(jobs: &[Job]) -> u64 {
    jobs.iter().map(|job| u64::from(job.len)).sum()
}
