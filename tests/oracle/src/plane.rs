//! Checks the exact mapper against its definition, on random planes of a texture.
//!
//! As in [`crate::mix`], a case depends only on the seed, its mix and its number.

use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

use fastrand::Rng;
use modex::{Destination, PlanarBuffer};
use texmap::mappers::exact;
use texmap::plane::{Anchor, Form, MAX_POSITION, Plane, PlaneStepper, ROUNDING};
use texmap::{Axis, Quotients, Texture};

use crate::mix::stream;
use crate::texel::{forms, perspective};

/// The camera's focal length: cases use it too.
pub use scene::FOCAL_LENGTH;

/// Columns drawn of each plane: setting up a plane costs as much as drawing some columns.
const COLUMNS: usize = 8;

/// A kind of plane. Every case has the property that the kind's name states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaneMix {
    /// From the near plane to 256 units, in one polygon.
    Deep,
    /// Within a unit of the eye.
    Near,
    /// Within 1/16 unit of the eye.
    Nearest,
    /// Facing the eye, with whole texels at pixels' centres: quotients that are whole numbers.
    Ties,
    /// Through the eye, or degenerate: three points on a line, or a single point.
    ThroughEye,
    /// From behind the eye to in front of it.
    AcrossEye,
    /// Entirely behind the eye.
    BehindEye,
}

impl PlaneMix {
    /// All mixes.
    pub const ALL: [Self; 7] = [
        Self::Deep,
        Self::Near,
        Self::Nearest,
        Self::Ties,
        Self::ThroughEye,
        Self::AcrossEye,
        Self::BehindEye,
    ];

    /// Returns the mix's name in the tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Deep => "to 256 units",
            Self::Near => "within a unit",
            Self::Nearest => "within 1/16 unit",
            Self::Ties => "whole texels on centres",
            Self::ThroughEye => "through the eye",
            Self::AcrossEye => "across the eye",
            Self::BehindEye => "behind the eye",
        }
    }

    /// Returns case `number` of this mix.
    pub fn case(self, seed: u64, number: u64) -> PlaneCase {
        let mut random = stream(seed, 32 + self as u64, number);
        let random = &mut random;
        let size = (side(random), side(random));
        // Bits of the largest z.
        let deepest = match self {
            Self::Deep => 24,
            Self::Near => 16,
            Self::Nearest => 12,
            _ => random.choice([24, 16, 12]).unwrap(),
        };
        let mut anchors = [(); 3].map(|()| anchor(random, 7, deepest, size));
        match self {
            Self::Deep | Self::Near | Self::Nearest => {}
            Self::Ties => anchors = facing(random, size),
            Self::ThroughEye => match random.u8(0..3) {
                0 => anchors[2].position = [0; 3],
                1 => anchors[2].position = anchors[1].position,
                _ => anchors = [anchors[0]; 3],
            },
            Self::AcrossEye => anchors[0].position = anchors[0].position.map(|k| -k),
            Self::BehindEye => {
                for anchor in &mut anchors {
                    anchor.position[2] = -anchor.position[2];
                }
            }
        }
        let columns = [(); COLUMNS].map(|()| {
            let (x, y) = (random.u16(0..320), random.u16(0..240));
            (x, y, random.u16(1..=240 - y))
        });
        PlaneCase {
            anchors,
            size,
            columns: columns.to_vec(),
        }
    }
}

/// Returns a side of a texture: powers of two and other numbers, single texels, the largest, any.
fn side(random: &mut Rng) -> u16 {
    match random.u8(0..4) {
        0 => random.u16(1..=4),
        1 => 1 << random.u16(0..=8),
        _ => random.u16(1..=256),
    }
}

/// Returns a point on or near the screen, with its z in a random magnitude of `nearest` to `deepest` bits.
pub fn anchor(random: &mut Rng, nearest: u32, deepest: u32, (w, h): (u16, u16)) -> Anchor {
    let bits = random.u32(nearest..deepest);
    let z = random.i32(1 << bits..2 << bits).min(MAX_POSITION);
    let at = |random: &mut Rng, reach: i64| {
        let pixel = random.i64(-reach..=reach);
        let limit = i64::from(MAX_POSITION);
        (pixel * i64::from(z) / i64::from(FOCAL_LENGTH)).clamp(-limit, limit) as i32
    };
    Anchor {
        position: [at(random, 400), at(random, 300), z],
        u: random.i32(0..=i32::from(w) << 16),
        v: random.i32(0..=i32::from(h) << 16),
    }
}

/// Three corners of a rectangle, all on pixels' centres and at whole texels. The scale is a power of two, so
/// that quantising the plane rounds nothing and the ties remain ties.
fn facing(random: &mut Rng, (w, h): (u16, u16)) -> [Anchor; 3] {
    let scale = 1 << random.u32(0..=12);
    let (x, y) = (random.i32(0..320), random.i32(0..240));
    // The next corners are 8 to 256 pixels away, to either side.
    let mut away = || random.choice([-1, 1]).unwrap() << random.u32(3..=8);
    let (across, down) = (away(), away());
    let mut anchor = |x: i32, y: i32| Anchor {
        position: [2 * x - 319, 2 * y - 239, 2 * FOCAL_LENGTH].map(|k| k * scale),
        u: random.i32(0..=w.into()) << 16,
        v: random.i32(0..=h.into()) << 16,
    };
    [anchor(x, y), anchor(x + across, y), anchor(x, y + down)]
}

/// A case: a plane, a texture's size, and columns of the screen as x, y, length.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlaneCase {
    /// The plane.
    pub anchors: [Anchor; 3],
    /// Texels across and down.
    pub size: (u16, u16),
    /// The columns to draw.
    pub columns: Vec<(u16, u16, u16)>,
}

impl PlaneCase {
    /// Reduces a failing case to its first failing column.
    pub fn shrink(&self, checker: &mut PlaneChecker) -> Self {
        let alone = self.columns.iter().map(|&column| Self {
            columns: vec![column],
            ..self.clone()
        });
        let failing = { alone }.find(|case| checker.case(case).is_err());
        failing.unwrap_or_else(|| self.clone())
    }

    /// Returns the source of a test with the case, for `kernel/texmap/tests/exact.rs`; `from` says where it
    /// was found.
    pub fn source(&self, wrong: &PlaneError, from: impl fmt::Display) -> String {
        let Self {
            anchors,
            size,
            columns,
        } = self;
        let [a, b, c] = anchors;
        format!(
            "/// {wrong}. Found by {from}.\n#[test]\nfn found_by_a_sweep() {{\n    \
             use oracle::plane::{{PlaneCase, PlaneChecker}};\n    \
             let case = PlaneCase {{\n        anchors: [\n            {a:?},\n            {b:?},\n            \
             {c:?},\n        ],\n        size: {size:?},\n        columns: vec!{columns:?},\n    }};\n    \
             assert_eq!(PlaneChecker::default().case(&case).err(), None);\n}}\n"
        )
    }
}

/// A reason why a case fails.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PlaneError {
    /// The mapper panicked.
    Panicked,
    /// A quantised form is further than [`ROUNDING`] from the exact form.
    Cut,
    /// The mapper read another texel than the floor of the quotient.
    Texel {
        /// The pixel's column.
        x: u16,
        /// The pixel's row.
        y: u16,
        /// Whether the texel differs down the texture, not across.
        down: bool,
        /// The way to compute the quotients.
        way: Quotients,
        /// The texel by the definition.
        expected: u16,
        /// The texel that the mapper read.
        found: u16,
    },
}

impl fmt::Display for PlaneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Panicked => write!(f, "the mapper panicked"),
            Self::Cut => write!(f, "quantisation moved a form by more than its bound"),
            Self::Texel {
                x,
                y,
                down,
                way,
                expected,
                found,
            } => {
                let axis = if *down { "down" } else { "across" };
                write!(
                    f,
                    "({x}, {y}) reads texel {found} {axis} by {way:?}, but the quotient's floor is {expected}"
                )
            }
        }
    }
}

impl std::error::Error for PlaneError {}

/// Counts of the comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlaneCounts {
    /// Pixels, each with both of its coordinates.
    pub samples: u64,
    /// Coordinates outside the texture.
    pub clamped: u64,
    /// Coordinates inside the texture that are whole numbers.
    pub ties: u64,
}

/// Checks cases, and owns the memory for the checks.
#[derive(Debug)]
pub struct PlaneChecker {
    page: Box<PlanarBuffer>,
    /// By width: texels that contain their column's number, and texels that contain their row's, 256 rows of
    /// each.
    axes: Vec<[Vec<u8>; 2]>,
}

impl Default for PlaneChecker {
    fn default() -> Self {
        Self {
            page: Box::new(PlanarBuffer::new()),
            axes: vec![Default::default(); usize::from(Texture::MAX_SIDE) + 1],
        }
    }
}

impl PlaneChecker {
    /// Checks a case, and returns the counts of the comparison.
    ///
    /// # Errors
    /// The first error found.
    pub fn case(&mut self, case: &PlaneCase) -> Result<PlaneCounts, PlaneError> {
        // A panic counts as a failure, so that the case is printed.
        catch_unwind(AssertUnwindSafe(|| self.columns(case))).unwrap_or(Err(PlaneError::Panicked))
    }

    fn columns(&mut self, case: &PlaneCase) -> Result<PlaneCounts, PlaneError> {
        let plane = Plane::new(&case.anchors, FOCAL_LENGTH);
        if !is_cut_by_one_shift(case, &plane) {
            return Err(PlaneError::Cut);
        }
        let mut compared = PlaneCounts::default();
        for &column in &case.columns {
            let more = self.column(case, &plane, column)?;
            compared.samples += more.samples;
            compared.clamped += more.clamped;
            compared.ties += more.ties;
        }
        Ok(compared)
    }

    fn column(
        &mut self,
        case: &PlaneCase,
        plane: &Plane,
        (x, y, len): (u16, u16, u16),
    ) -> Result<PlaneCounts, PlaneError> {
        let (w, h) = case.size;
        let axes = &mut self.axes[usize::from(w)];
        if axes[0].is_empty() {
            let texels = |of: fn(u16, u16) -> u16| -> Vec<u8> {
                let rows = 0..Texture::MAX_SIDE;
                let texels = rows.flat_map(|j| (0..w).map(move |i| of(i, j) as u8));
                texels.collect()
            };
            *axes = [texels(|i, _| i), texels(|_, j| j)];
        }
        let mut marks = [(false, false); 240];
        for (down, (form, size)) in [(false, (plane.a, w)), (true, (plane.b, h))] {
            let texels = &axes[usize::from(down)][..usize::from(w) * usize::from(h)];
            let texture = Texture::new(texels, w, h).expect("a legal size");
            let stepper = PlaneStepper::new(plane, Axis::Down, x, y);
            for way in Quotients::ALL.into_iter().filter(|way| way.runs_here()) {
                self.page.column(x, y, len, |column| {
                    exact::column(&texture, stepper, way, column)
                });
                for y in y..y + len {
                    let (n, c) = (at(&form, x, y), at(&plane.c, x, y));
                    let expected = perspective(n, c, size);
                    let found = self.page.pixel(x.into(), y.into()).into();
                    if expected != found {
                        return Err(PlaneError::Texel {
                            x,
                            y,
                            down,
                            way,
                            expected,
                            found,
                        });
                    }
                }
            }
            for (y, (clamped, tied)) in (y..y + len).zip(&mut marks) {
                let (n, c) = (at(&form, x, y), at(&plane.c, x, y));
                let outside = n < 0 || n >= i128::from(size) * c;
                *clamped |= outside;
                *tied |= !outside && n == i128::from(perspective(n, c, size)) * c;
            }
        }
        let marks = &marks[..len.into()];
        Ok(PlaneCounts {
            samples: len.into(),
            clamped: marks.iter().filter(|mark| mark.0).count() as u64,
            ties: marks.iter().filter(|mark| mark.1).count() as u64,
        })
    }
}

/// Returns a form's value at a pixel's centre.
fn at(form: &Form, x: u16, y: u16) -> i128 {
    let [origin, right, down] = [form.origin, form.right, form.down].map(i128::from);
    origin + right * i128::from(x) + down * i128::from(y)
}

/// Returns whether a single shift turns the exact forms into the plane's forms, within [`ROUNDING`], at the
/// upper end of the first column and at the lower end of the last.
fn is_cut_by_one_shift(case: &PlaneCase, plane: &Plane) -> bool {
    let upper = case.columns.first().map(|&(x, y, _)| (x, y));
    let lower = case.columns.last().map(|&(x, y, len)| (x, y + len - 1));
    let pixels = upper.into_iter().chain(lower).map(|(x, y)| {
        let cut = [plane.a, plane.b, plane.c].map(|form| at(&form, x, y));
        (cut, forms(&case.anchors, FOCAL_LENGTH, x, y))
    });
    let pixels: Vec<_> = pixels.collect();
    (0..48).any(|shift| {
        let near = |(cut, real): (&i128, &i128)| {
            ((cut << shift) - real).abs() <= i128::from(ROUNDING) << shift
        };
        let all = |(cut, real): &([i128; 3], [i128; 3])| cut.iter().zip(real).all(near);
        pixels.iter().all(all)
    })
}
