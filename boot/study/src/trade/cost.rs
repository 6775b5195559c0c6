//! The costs of the mappers in RAM, on this CPU.
//!
//! Everything is drawn into a planar buffer. Times vary by several per cent from run to run, and with the
//! load of the machine, so they are reported as ratios of times from the same race. Every contestant draws in
//! every round, every second round runs backwards, and each ratio is of two times of one round. A round's
//! time is that of the fastest of several drawings in a row, because a disturbance can only make a drawing
//! slower.

use modex::{Destination, PlanarBuffer};
use texmap::plane::Anchor;
use texmap::{
    Axis, Job, Loop, Mapper, Order, Quotients, Renderer, SpanKind, Style, Texture, Vertex,
};

use super::accuracy::FrameJobs;
use super::clock;
use super::stats::Spread;
use super::workload::{OwnedFace, Workload};

/// The number of rounds. The reported value is their median.
pub const ROUNDS: usize = 5;

/// The orders that differ in RAM. [`Order::Buffer`] draws like one of these, and presenting costs time only
/// on a VGA.
pub const ORDERS: [Order; 2] = [Order::Polygons, Order::Planes];

/// The work that is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scope {
    /// Drawing alone, of jobs made beforehand.
    Loops,
    /// A whole frame: making its jobs and drawing them.
    Frame,
}

/// The order in which the bare loop visits the pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Traversal {
    /// Down the columns.
    Columns,
    /// Along the rows, pixel by pixel.
    Rows,
    /// Along the rows, in four passes.
    Passes,
}

/// The code that draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Drawer {
    /// A load and a store for each pixel, and nothing else.
    Bare(Traversal),
    Mapper(Mapper),
    /// The loop of a CPU with fewer instructions than this one.
    Lesser(LesserLoop),
}

impl Drawer {
    /// Returns the bare loop that visits the pixels as the mapper does.
    fn bare(mapper: Mapper) -> Self {
        use texmap::Rows;
        Self::Bare(match mapper {
            Mapper::Rows(Rows::Passes) => Traversal::Passes,
            Mapper::Rows(_) => Traversal::Rows,
            _ => Traversal::Columns,
        })
    }
}

type ContestantKey = (Drawer, Order, Scope);

/// The memory that drawing needs.
struct DrawMemory {
    page: Box<PlanarBuffer>,
    jobs: Box<FrameJobs>,
}

type DrawFn<'a> = Box<dyn Fn(&mut DrawMemory) + 'a>;

struct Contestant<'a> {
    key: ContestantKey,
    pixels: u64,
    draw: DrawFn<'a>,
}

/// A loop with the same texels as a mapper's own loop, for a CPU with fewer instructions than this one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LesserLoop {
    /// The portable version of an affine loop.
    Portable(Loop),
    /// A way to compute exact quotients.
    Quotients(Quotients),
}

impl LesserLoop {
    /// Returns the lesser loops of a mapper, if its own loop has instructions beyond the baseline of the
    /// CPU's architecture.
    pub fn of(mapper: Mapper) -> Vec<Self> {
        match mapper {
            Mapper::Affine(Loop::Extract) if Loop::Extract.is_tuned_here() => {
                vec![Self::Portable(Loop::Extract)]
            }
            Mapper::Exact => {
                let ways = Quotients::ALL.into_iter().rev();
                let lesser = ways.filter(|&way| way.runs_here() && way != Quotients::fastest());
                lesser.map(Self::Quotients).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Returns the mapper that has the same texels.
    fn mapper(self) -> Mapper {
        match self {
            Self::Portable(by) => Mapper::Affine(by),
            Self::Quotients(_) => Mapper::Exact,
        }
    }

    /// Returns what the loop does with or without.
    pub fn label(self) -> &'static str {
        match self {
            Self::Portable(_) => "without BMI2",
            Self::Quotients(Quotients::Avx512) => "with AVX-512",
            Self::Quotients(Quotients::Avx2) => "with AVX2",
            Self::Quotients(Quotients::Guess) => "without AVX",
            Self::Quotients(Quotients::Divide) => "by integer divisions",
        }
    }
}

/// The cost of drawing a pixel.
#[derive(Clone, Copy, Debug)]
pub struct PixelCost {
    /// The time, in [`clock::UNIT`]s.
    pub time: Spread,
    /// The ratio to a bare load and store for each pixel, in the same order.
    pub to_bare: Spread,
    /// The ratio to the mapper `packed`, polygon by polygon, at the same work.
    pub to_packed: Spread,
}

/// The costs of one mapper.
#[derive(Clone, Debug)]
pub struct MapperCost {
    /// The mapper.
    pub mapper: Mapper,
    /// The order.
    pub order: Order,
    /// The cost of drawing alone.
    pub loops: PixelCost,
    /// The cost of the whole frame.
    pub frame: PixelCost,
    /// The costs of drawing alone with the mapper's lesser loops.
    pub lesser: Vec<(LesserLoop, PixelCost)>,
}

/// The time that a measurement may need.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// The time of drawing for one value, in [`clock::UNIT`]s. At least two drawings are made.
    pub slice: u64,
}

impl Effort {
    /// The effort for reliable figures.
    pub const FULL: Self = Self { slice: 12_000_000 };
    /// The effort of a test: enough to run all of the code.
    pub const QUICK: Self = Self { slice: 600_000 };
}

/// Returns the jobs of a mapper on faces, and the number of their pixels.
///
/// # Panics
/// If a face is not legal.
fn jobs(mapper: Mapper, faces: &[OwnedFace], workload: &Workload<'_>) -> (Vec<Job>, u64) {
    let mut jobs = Vec::new();
    for face in faces {
        let face = face.face();
        let texture = workload.texture(face.texture);
        let made = mapper.jobs(&face, texture, |job| jobs.push(job));
        made.expect("a scene's faces are legal");
    }
    let mut pixels = 0;
    for job in &jobs {
        job.pixels(workload.texture(job.texture), |_, _| pixels += 1);
    }
    (jobs, pixels)
}

/// Sorts jobs by plane, if the order requires it. [`Renderer`] chains jobs by plane; here the sorting is not
/// part of the timed work.
fn in_order(order: Order, (mut jobs, pixels): (Vec<Job>, u64)) -> (Vec<Job>, u64) {
    if order != Order::Polygons {
        jobs.sort_by_key(|job| job.x & 3);
    }
    (jobs, pixels)
}

/// Draws jobs as [`Renderer`] does.
fn draw(
    jobs: &[Job],
    style: Style,
    order: Order,
    textures: &[Texture<'_>],
    page: &mut PlanarBuffer,
) {
    match order {
        Order::Polygons => {
            for job in jobs {
                job.draw(style, &textures[usize::from(job.texture)], page);
            }
        }
        Order::Planes | Order::Buffer => {
            for plane in 0..4 {
                page.select(plane);
                for job in jobs {
                    let texture = &textures[usize::from(job.texture)];
                    job.draw_in_plane(plane, style, texture, page);
                }
            }
        }
    }
}

/// Draws affine columns with the portable reference of a loop.
fn draw_by_portable(
    jobs: &[Job],
    portable: Loop,
    order: Order,
    textures: &[Texture<'_>],
    page: &mut PlanarBuffer,
) {
    let mut one = |job: &Job| {
        let SpanKind::Affine(stepper) = job.kind else {
            unreachable!("the loops are affine");
        };
        let texture = &textures[usize::from(job.texture)];
        page.column(job.x, job.y, job.len, |column| {
            portable.portable(texture, stepper, column);
        });
    };
    match order {
        Order::Polygons => jobs.iter().for_each(one),
        Order::Planes | Order::Buffer => {
            for plane in 0..4 {
                jobs.iter()
                    .filter(|job| job.x & 3 == plane)
                    .for_each(&mut one);
            }
        }
    }
}

/// Loads and stores a byte for every pixel of some jobs.
fn bare(
    jobs: &[Job],
    traversal: Traversal,
    order: Order,
    texels: &[u8; 256],
    page: &mut PlanarBuffer,
) {
    // Only with a byte as the index does the compiler see that no bounds check is needed.
    let mut at = 0u8;
    let mut load = || {
        at = at.wrapping_add(1);
        texels[usize::from(at)]
    };
    let mut part = |job: &Job, plane: u16, page: &mut PlanarBuffer| {
        let first = plane.wrapping_sub(job.x) & 3;
        if first < job.len {
            let len = (job.len - first).div_ceil(4);
            page.lane::<1>(job.x + first, job.y, len, |row| row.fill(&mut load));
        }
    };
    match (order, traversal) {
        (Order::Polygons, Traversal::Columns) => {
            for job in jobs {
                page.column(job.x, job.y, job.len, |column| column.fill(&mut load));
            }
        }
        (Order::Planes | Order::Buffer, Traversal::Columns) => {
            for plane in 0..4 {
                for job in jobs.iter().filter(|job| job.x & 3 == plane) {
                    page.lane(job.x, job.y, job.len, |column: modex::Column<'_>| {
                        column.fill(&mut load);
                    });
                }
            }
        }
        (Order::Polygons, Traversal::Rows) => {
            for job in jobs {
                page.row(job.x, job.y, job.len, &mut load);
            }
        }
        (Order::Polygons, Traversal::Passes) => {
            for job in jobs {
                (0..4).for_each(|plane| part(job, plane, page));
            }
        }
        (Order::Planes | Order::Buffer, Traversal::Rows | Traversal::Passes) => {
            for plane in 0..4 {
                jobs.iter().for_each(|job| part(job, plane, page));
            }
        }
    }
}

/// Returns every contestant on some faces: the mappers, and the bare loops that they are compared with.
fn contestants<'a>(
    mappers: &[Mapper],
    faces: &'a [OwnedFace],
    workload: &'a Workload<'_>,
    scope: &[Scope],
) -> Vec<Contestant<'a>> {
    let texels: &[u8; 256] = workload.textures[0].texels()[..256]
        .try_into()
        .expect("the slice has 256 texels");
    let mut all = Vec::new();
    let affine = Mapper::parse("affine").expect("the mapper exists");
    let by_rows = Mapper::parse("row-steps").expect("the mapper exists");
    for (traversal, mapper) in [
        (Traversal::Columns, affine),
        (Traversal::Rows, by_rows),
        (Traversal::Passes, by_rows),
    ] {
        if traversal != Traversal::Columns
            && !mappers
                .iter()
                .any(|&m| Drawer::bare(m) == Drawer::Bare(traversal))
        {
            continue;
        }
        for order in ORDERS {
            let (jobs, pixels) = in_order(order, jobs(mapper, faces, workload));
            let axis = if traversal == Traversal::Columns {
                Axis::Down
            } else {
                Axis::Right
            };
            assert!(jobs.iter().all(|job| job.axis == axis));
            all.push(Contestant {
                key: (Drawer::Bare(traversal), order, Scope::Loops),
                pixels,
                draw: Box::new(move |arena| bare(&jobs, traversal, order, texels, &mut arena.page)),
            });
        }
    }
    for lesser in mappers.iter().copied().flat_map(LesserLoop::of) {
        let mapper = lesser.mapper();
        for order in ORDERS {
            let (jobs, pixels) = in_order(order, jobs(mapper, faces, workload));
            let textures = &workload.textures;
            let draw: DrawFn<'a> = match lesser {
                LesserLoop::Portable(portable) => Box::new(move |arena| {
                    draw_by_portable(&jobs, portable, order, textures, &mut arena.page);
                }),
                LesserLoop::Quotients(quotients) => {
                    let style = Style {
                        quotients,
                        ..mapper.style()
                    };
                    Box::new(move |arena| draw(&jobs, style, order, textures, &mut arena.page))
                }
            };
            all.push(Contestant {
                key: (Drawer::Lesser(lesser), order, Scope::Loops),
                pixels,
                draw,
            });
        }
    }
    for &mapper in mappers {
        for order in ORDERS {
            for &scope in scope {
                let (jobs, pixels) = in_order(order, jobs(mapper, faces, workload));
                let draw: DrawFn<'a> = match scope {
                    Scope::Loops => Box::new(move |arena| {
                        let style = mapper.style();
                        draw(&jobs, style, order, &workload.textures, &mut arena.page);
                    }),
                    Scope::Frame => Box::new(move |arena| {
                        let DrawMemory { page, jobs } = arena;
                        let textures = &workload.textures;
                        let mut renderer =
                            Renderer::new(&mut **jobs, textures, &mut **page, mapper, order);
                        for face in faces {
                            renderer.face(&face.face());
                        }
                        std::hint::black_box(renderer.finish());
                    }),
                };
                all.push(Contestant {
                    key: (Drawer::Mapper(mapper), order, scope),
                    pixels,
                    draw,
                });
            }
        }
    }
    all
}

/// Returns the time a pixel of each contestant in each round.
fn race(contestants: &[Contestant<'_>], effort: Effort) -> Vec<Vec<f64>> {
    let mut arena = DrawMemory {
        page: Box::new(PlanarBuffer::new()),
        jobs: Box::new(FrameJobs::new()),
    };
    let mut time = |contestant: &Contestant<'_>| {
        let start = clock::now();
        (contestant.draw)(&mut arena);
        clock::now() - start
    };
    let mut times = vec![Vec::new(); contestants.len()];
    let mut order: Vec<usize> = (0..contestants.len()).collect();
    for _ in 0..ROUNDS {
        for &i in &order {
            let contestant = &contestants[i];
            // The first drawing warms the caches.
            let first = time(contestant).max(1);
            let drawings = (effort.slice / first).clamp(2, 1000);
            let fastest = (0..drawings).map(|_| time(contestant)).min();
            let fastest = fastest.unwrap_or(first).max(1) as f64;
            times[i].push(fastest / contestant.pixels.max(1) as f64);
        }
        order.reverse();
    }
    times
}

/// Returns the ratio of two contestants' times, round by round.
fn ratio(times: &[f64], others: &[f64]) -> Spread {
    let ratios: Vec<f64> = times.iter().zip(others).map(|(a, b)| a / b).collect();
    Spread::of(&ratios)
}

/// The times of a race, by contestant.
struct Times(Vec<(ContestantKey, Vec<f64>)>);

impl Times {
    fn of(&self, key: ContestantKey) -> Option<&[f64]> {
        let found = self.0.iter().find(|(known, _)| *known == key);
        found.map(|(_, times)| &times[..])
    }

    fn cost(&self, mapper: Mapper, order: Order, scope: Scope) -> PixelCost {
        let cost = self.cost_of((Drawer::Mapper(mapper), order, scope), Drawer::bare(mapper));
        cost.expect("the contestant took part")
    }

    fn cost_of(&self, key: ContestantKey, bare: Drawer) -> Option<PixelCost> {
        let (_, order, scope) = key;
        let times = self.of(key)?;
        let to = |key| match self.of(key) {
            Some(others) => ratio(times, others),
            None => Spread::of(&[f64::NAN]),
        };
        let packed = Mapper::parse("packed").expect("the mapper exists");
        Some(PixelCost {
            time: Spread::of(times),
            to_bare: to((bare, order, Scope::Loops)),
            to_packed: to((Drawer::Mapper(packed), Order::Polygons, scope)),
        })
    }
}

/// Returns the costs of `mappers` on a frame of a workload. `packed` always takes part.
pub fn measure(
    workload: &Workload<'_>,
    number: usize,
    mappers: &[Mapper],
    effort: Effort,
) -> Vec<MapperCost> {
    let mut all = mappers.to_vec();
    let packed = Mapper::parse("packed").expect("the mapper exists");
    if !all.contains(&packed) {
        all.push(packed);
    }
    let faces = &workload.frames[number];
    let contestants = contestants(&all, faces, workload, &[Scope::Loops, Scope::Frame]);
    let raced = race(&contestants, effort);
    let times = Times(contestants.iter().map(|c| c.key).zip(raced).collect());
    let mut costs = Vec::new();
    for &mapper in mappers {
        for order in ORDERS {
            costs.push(MapperCost {
                mapper,
                order,
                loops: times.cost(mapper, order, Scope::Loops),
                frame: times.cost(mapper, order, Scope::Frame),
                lesser: LesserLoop::of(mapper)
                    .into_iter()
                    .filter_map(|lesser| {
                        let key = (Drawer::Lesser(lesser), order, Scope::Loops);
                        Some((lesser, times.cost_of(key, Drawer::bare(mapper))?))
                    })
                    .collect(),
            });
        }
    }
    costs
}

/// The cost of drawing alone for spans of one length, with the texture at one angle.
#[derive(Clone, Copy, Debug)]
pub struct SweepPoint {
    /// The pixels of each span down a column.
    pub length: u16,
    /// The texture's angle on the screen, in degrees.
    pub angle: f64,
    /// The mapper.
    pub mapper: Mapper,
    /// The order.
    pub order: Order,
    /// The cost of drawing alone.
    pub cost: PixelCost,
}

/// The points of a sweep with spans of [`LENGTH`], at [`ANGLE`].
#[derive(Clone, Copy, Debug)]
pub struct LongSpans<'a>(pub &'a [SweepPoint]);

impl<'a> LongSpans<'a> {
    /// Returns the points of an order.
    fn points(self, order: Order) -> impl Iterator<Item = &'a SweepPoint> {
        let matches = move |point: &&SweepPoint| {
            point.length == LENGTH && point.angle == ANGLE && point.order == order
        };
        self.0.iter().filter(matches)
    }

    /// Returns the point of the fastest affine column loop.
    pub fn fastest_affine(self, order: Order) -> Option<&'a SweepPoint> {
        let affine = self
            .points(order)
            .filter(|point| matches!(point.mapper, Mapper::Affine(_)));
        affine.min_by(|a, b| a.cost.time.median.total_cmp(&b.cost.time.median))
    }

    /// Returns the median time of a mapper, if it was measured.
    pub fn time(self, mapper: &str, order: Order) -> Option<f64> {
        let mut points = self.points(order);
        let point = points.find(|point| point.mapper.to_string() == mapper);
        point.map(|point| point.cost.time.median)
    }
}

/// The span lengths to sweep, at [`ANGLE`].
pub const LENGTHS: [u16; 10] = [1, 2, 4, 8, 16, 32, 64, 120, 180, 240];
/// The angles to sweep besides [`ANGLE`], with spans of [`LENGTH`].
pub const ANGLES: [f64; 6] = [0.0, 15.0, 45.0, 60.0, 75.0, 90.0];
/// The angle at which lengths are swept, in degrees.
pub const ANGLE: f64 = 30.0;
/// The length at which angles are swept, in pixels.
pub const LENGTH: u16 = 240;
/// Texels a pixel. With this scale the rotated screen fits into the texture at any angle.
const SCALE: f64 = 0.63;

/// Returns strips over the whole screen, each `length` pixels high, in one facing plane whose texture is
/// rotated by `angle` degrees.
fn strips(length: u16, angle: f64) -> Vec<OwnedFace> {
    let (sin, cos) = angle.to_radians().sin_cos();
    let texel = |x: i32, y: i32| {
        let (x, y) = (f64::from(x - 160) * SCALE, f64::from(y - 120) * SCALE);
        [128.0 + cos * x - sin * y, 128.0 + sin * x + cos * y]
            .map(|at| (at * 65_536.0).round() as i32)
    };
    let length = i32::from(length);
    let strip = |k: i32| {
        let (top, bottom) = (k * length, (k + 1) * length);
        let places = [(0, top), (320, top), (320, bottom), (0, bottom)];
        let polygon = places.map(|(x, y)| {
            let [u, v] = texel(x, y);
            Vertex {
                x: x * texmap::SUBPIXELS,
                y: y * texmap::SUBPIXELS,
                u,
                v,
            }
        });
        // Two units away. The position on the plane does not matter.
        let far = 2 * 65_536;
        let anchors = [(0, 0), (320, 0), (320, 240)].map(|(x, y)| {
            let [u, v] = texel(x, y);
            let out = |pixels: i32| pixels * far / scene::FOCAL_LENGTH;
            Anchor {
                position: [out(x - 160), out(y - 120), far],
                u,
                v,
            }
        });
        OwnedFace::from_parts(polygon.to_vec(), anchors)
    };
    (0..240 / length).map(strip).collect()
}

/// Sweeps span lengths and angles. Calls `done` after each of the [`SWEEPS`] steps.
pub fn sweep(
    workload: &Workload<'_>,
    mappers: &[Mapper],
    effort: Effort,
    mut done: impl FnMut(),
) -> Vec<SweepPoint> {
    let mut all = mappers.to_vec();
    let packed = Mapper::parse("packed").expect("the mapper exists");
    if !all.contains(&packed) {
        all.push(packed);
    }
    let lengths = LENGTHS.iter().map(|&length| (length, ANGLE));
    let angles = ANGLES.iter().map(|&angle| (LENGTH, angle));
    let mut points = Vec::new();
    for (length, angle) in lengths.chain(angles) {
        let faces = strips(length, angle);
        let contestants = contestants(&all, &faces, workload, &[Scope::Loops]);
        let raced = race(&contestants, effort);
        let times = Times(contestants.iter().map(|c| c.key).zip(raced).collect());
        for &mapper in mappers {
            for order in ORDERS {
                points.push(SweepPoint {
                    length,
                    angle,
                    mapper,
                    order,
                    cost: times.cost(mapper, order, Scope::Loops),
                });
            }
        }
        done();
    }
    points
}

/// Returns the gain from unrolling: the time of a plain loop, relative to the time of the same loop unrolled
/// eight times, on the longest strips, plane by plane.
pub fn unrolling(workload: &Workload<'_>, effort: Effort) -> Spread {
    let affine = Mapper::parse("affine").expect("the mapper exists");
    let faces = strips(LENGTH, ANGLE);
    let texels: &[u8; 1 << 16] = workload.textures[0]
        .texels()
        .try_into()
        .expect("the workload's texture is the largest");
    let stepped = |job: &Job| {
        let SpanKind::Affine(stepper) = job.kind else {
            unreachable!("the mapper is affine");
        };
        let (mut u, mut v) = (stepper.u as u32, stepper.v as u32);
        move || {
            let texel = texels[usize::from(((v >> 8) & 0xFF00 | (u >> 16) & 0xFF) as u16)];
            u = u.wrapping_add(stepper.du as u32);
            v = v.wrapping_add(stepper.dv as u32);
            texel
        }
    };
    let contestant = |unrolled: bool| {
        let (jobs, pixels) = jobs(affine, &faces, workload);
        let columns = move |arena: &mut DrawMemory| {
            for plane in 0..4 {
                for job in jobs.iter().filter(|job| job.x & 3 == plane) {
                    let mut next = stepped(job);
                    arena
                        .page
                        .lane(job.x, job.y, job.len, |mut column: modex::Column<'_>| {
                            while unrolled && column.len() >= 8 {
                                let (eight, rest) = column.split(8);
                                eight.fill(&mut next);
                                column = rest;
                            }
                            column.fill(next);
                        });
                }
            }
        };
        Contestant {
            key: (
                Drawer::Bare(Traversal::Columns),
                Order::Planes,
                Scope::Loops,
            ),
            pixels,
            draw: Box::new(columns),
        }
    };
    let times = race(&[contestant(false), contestant(true)], effort);
    ratio(&times[0], &times[1])
}

/// The number of steps of [`sweep`].
pub const SWEEPS: usize = LENGTHS.len() + ANGLES.len();

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trade::workload::with;

    const TINY: Effort = Effort { slice: 1 };

    fn some() -> Vec<Mapper> {
        ["row-steps", "row-passes", "packed", "extract", "exact"]
            .map(|name| Mapper::parse(name).unwrap())
            .to_vec()
    }

    #[test]
    fn every_mapper_has_a_cost_in_every_order() {
        with("tilted", 0, |workload| {
            let costs = measure(workload, 1, &some(), TINY);
            assert_eq!(costs.len(), 2 * some().len());
            for costs in &costs {
                let lesser = LesserLoop::of(costs.mapper).into_iter();
                assert!(lesser.eq(costs.lesser.iter().map(|&(by, _)| by)));
                for cost in [costs.loops, costs.frame] {
                    for spread in [cost.time, cost.to_bare, cost.to_packed] {
                        assert!(spread.least > 0.0 && spread.most.is_finite(), "{costs:?}");
                    }
                }
            }
            let packed = costs
                .iter()
                .find(|costs| costs.mapper.to_string() == "packed");
            let packed = packed.unwrap();
            assert_eq!(packed.order, Order::Polygons);
            assert_eq!(packed.loops.to_packed.median, 1.0);
            assert_eq!(packed.loops.to_packed.percent(), 0.0);
        });
    }

    /// Checks that the timed code draws the right pixels: mappers draw the renderer's frame, and bare loops
    /// draw as many pixels.
    #[test]
    fn every_contestant_draws_the_whole_frame() {
        with("tilted", 0, |workload| {
            let mappers = some();
            let faces = &workload.frames[1];
            let all = contestants(&mappers, faces, workload, &[Scope::Loops, Scope::Frame]);
            let lesser: usize = mappers.iter().map(|&m| LesserLoop::of(m).len()).sum();
            assert_eq!(all.len(), 2 * (3 + lesser + 2 * mappers.len()));
            let drawn = |contestant: &Contestant<'_>| {
                let mut arena = DrawMemory {
                    page: Box::new(PlanarBuffer::new()),
                    jobs: Box::new(FrameJobs::new()),
                };
                // A colour that no lit texel has.
                arena.page.planes = [[0; modex::PAGE_BYTES]; 4];
                (contestant.draw)(&mut arena);
                arena.page
            };
            let touched = |page: &PlanarBuffer| {
                let bytes = page.planes.as_flattened();
                bytes.iter().filter(|&&byte| byte != 0).count() as u64
            };
            for contestant in &all {
                let page = drawn(contestant);
                assert_eq!(touched(&page), contestant.pixels, "{:?}", contestant.key);
                let mapper = match contestant.key.0 {
                    Drawer::Bare(_) => continue,
                    Drawer::Mapper(mapper) => mapper,
                    Drawer::Lesser(lesser) => lesser.mapper(),
                };
                let same = all
                    .iter()
                    .find(|other| other.key.0 == Drawer::Mapper(mapper));
                assert!(page == drawn(same.unwrap()), "{:?}", contestant.key);
            }
        });
    }

    #[test]
    fn strips_cover_the_screen_and_stay_in_the_texture() {
        with("tilted", 0, |workload| {
            for (length, angle) in [(1, 45.0), (64, 10.0), (240, 90.0)] {
                let faces = strips(length, angle);
                for mapper in some() {
                    let (jobs, pixels) = jobs(mapper, &faces, workload);
                    assert_eq!(pixels, 320 * (240 / u64::from(length)) * u64::from(length));
                    if jobs[0].axis == Axis::Down {
                        assert!(jobs.iter().all(|job| job.len == length));
                    }
                }
            }
        });
    }
}
