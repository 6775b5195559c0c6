//! Whole solids in any pose: nothing dropped, no gap, and each face where lines of sight meet it.
//!
//! As in [`crate::mix`], a case depends only on the seed, its mix and its number.

use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

use fastrand::Rng;
use in_place::InPlace;
use modex::{Destination, HEIGHT, Lane, Palette, PlanarBuffer, STRIDE, WIDTH};
use render::{RenderMemory, RenderOptions, SceneRenderer};
use scene::{
    Corner, FOCAL_LENGTH, LIGHT_LEVELS, LightTable, Mesh, MeshFace, NEAR, Pose, Scene, Vec3,
};
use texmap::{MAX_COORDINATE, Point, Stats, Texture};

use crate::coverage::{Area, Pixels, Row, inside};
use crate::mix::stream;
use crate::sight;

/// 1 unit, 16.16.
const UNIT: i32 = 1 << 16;
/// Texels of a side of the solids' texture.
const TEXELS: u16 = 16;

/// A solid with one texture that owns its data.
#[derive(Clone, Debug)]
pub struct Solid {
    /// Points, 16.16.
    pub vertices: Vec<Vec3>,
    corners: Vec<Corner>,
    faces: Vec<MeshFace>,
    convex: bool,
}

impl Solid {
    /// Returns a solid from its faces, whose vertices are listed clockwise as seen from outside.
    pub fn new(vertices: &[Vec3], faces: &[&[u16]]) -> Self {
        let mut solid = Self {
            vertices: vertices.to_vec(),
            corners: Vec::new(),
            faces: Vec::new(),
            convex: true,
        };
        for face in faces {
            solid.faces.push(MeshFace {
                first: solid.corners.len() as u16,
                corners: face.len() as u16,
                texture: 0,
                normal: [0, 0, -1 << 14],
            });
            let side = i32::from(TEXELS) << 16;
            let places = [(0, 0), (side, 0), (side, side), (0, side)];
            for (i, &vertex) in face.iter().enumerate() {
                let (u, v) = places[i % 4];
                solid.corners.push(Corner { vertex, u, v });
            }
        }
        solid
    }

    /// Returns a box with these half sides: bit k of a vertex is its sign along axis k.
    pub fn cuboid(half: Vec3) -> Self {
        let vertices: Vec<Vec3> = (0..8)
            .map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 1 { half[k] } else { -half[k] }))
            .collect();
        Self::new(
            &vertices,
            &[
                &[0, 1, 3, 2],
                &[5, 4, 6, 7],
                &[4, 0, 2, 6],
                &[1, 5, 7, 3],
                &[4, 5, 1, 0],
                &[2, 3, 7, 6],
            ],
        )
    }

    /// Returns the unit octahedron. Each of its edges can lie exactly on pixels' centres.
    pub fn octahedron() -> Self {
        let axes = [0, 1, 2].map(|k| [0, 1, 2].map(|i| i32::from(i == k) << 16));
        let vertices: Vec<Vec3> = axes.iter().flat_map(|&a| [a, a.map(|k| -k)]).collect();
        let mut faces = Vec::new();
        for signs in 0..8u16 {
            let [x, y, z] = [signs & 1, 2 + (signs >> 1 & 1), 4 + (signs >> 2)];
            let odd = signs.count_ones() % 2 == 1;
            faces.push(if odd { [x, y, z] } else { [x, z, y] });
        }
        let faces: Vec<&[u16]> = faces.iter().map(|face| &face[..]).collect();
        Self::new(&vertices, &faces)
    }

    /// Returns the demo's unit ball.
    pub fn ball() -> Self {
        let mesh = scene::ball(&[]).mesh;
        let mut solid = Self {
            vertices: mesh.vertices.to_vec(),
            corners: mesh.corners.to_vec(),
            faces: mesh.faces.to_vec(),
            convex: true,
        };
        // The texture differs from the demo's. Coordinates only have to be inside it.
        for corner in &mut solid.corners {
            corner.u %= i32::from(TEXELS) << 16;
            corner.v %= i32::from(TEXELS) << 16;
        }
        solid
    }

    /// Turns every face over: the inside becomes the outside.
    #[must_use]
    pub fn inside_out(mut self) -> Self {
        for face in &self.faces {
            self.corners[usize::from(face.first)..][..usize::from(face.corners)].reverse();
        }
        self
    }

    /// Moves the solid so that `eye` is at the origin: at distance 0 the eye is there.
    #[must_use]
    pub fn seen_from(mut self, eye: Vec3) -> Self {
        for vertex in &mut self.vertices {
            *vertex = [0, 1, 2].map(|k| vertex[k] - eye[k]);
        }
        self
    }

    /// Scales the distance of each vertex from the centre by the next of `lengths` (16.16), in turn. Any
    /// lengths leave a surface that each ray from the centre meets once.
    #[must_use]
    pub fn stretched(mut self, lengths: &[i32]) -> Self {
        for (vertex, &length) in self.vertices.iter_mut().zip(lengths.iter().cycle()) {
            *vertex = vertex.map(|k| ((i64::from(k) * i64::from(length)) >> 16) as i32);
        }
        self
    }

    /// Returns the largest absolute value of a coordinate, 16.16.
    pub fn extent(&self) -> i32 {
        let coordinates = self.vertices.iter().flatten();
        coordinates.map(|k| k.abs()).max().unwrap_or(0)
    }

    /// Marks the solid as not convex: its faces may hide each other.
    #[must_use]
    pub fn concave(mut self) -> Self {
        self.convex = false;
        self
    }

    /// Joins both solids in one mesh, whose faces may hide each other.
    #[must_use]
    pub fn and(mut self, other: &Self) -> Self {
        let (vertices, corners) = (self.vertices.len() as u16, self.corners.len() as u16);
        self.vertices.extend(&other.vertices);
        self.corners
            .extend(other.corners.iter().map(|corner| Corner {
                vertex: vertices + corner.vertex,
                ..*corner
            }));
        self.faces.extend(other.faces.iter().map(|face| MeshFace {
            first: corners + face.first,
            ..*face
        }));
        self.concave()
    }

    /// Calls `act` with a renderer of the solid.
    pub fn with_renderer<T>(
        &self,
        memory: &mut RenderMemory,
        act: impl FnOnce(&mut SceneRenderer<'_>) -> T,
    ) -> T {
        static LIGHT: LightTable = [[1; 256]; LIGHT_LEVELS];
        static PALETTE: Palette = [[0; 3]; 256];
        static BACKGROUND: [u8; HEIGHT] = [0; HEIGHT];
        let texels = [0; TEXELS as usize * TEXELS as usize];
        let textures =
            [Texture::new(&texels, TEXELS, TEXELS).expect("the texels fill the texture")];
        let scene = Scene {
            name: "test",
            mesh: Mesh {
                vertices: &self.vertices,
                corners: &self.corners,
                faces: &self.faces,
                convex: self.convex,
            },
            textures: &textures,
            palette: &PALETTE,
            light: &LIGHT,
            background: &BACKGROUND,
            mipmaps: false,
        };
        act(&mut SceneRenderer::new(memory, scene))
    }

    /// Returns the corners of each face in view space.
    fn views(&self, pose: &Pose) -> impl Iterator<Item = Vec<Vec3>> {
        let orientation = pose.orientation();
        let view = move |corner: &Corner| {
            let [x, y, z] = orientation.turn(self.vertices[usize::from(corner.vertex)]);
            [x, y, z + pose.distance]
        };
        self.faces.iter().map(move |face| {
            let corners = &self.corners[usize::from(face.first)..][..usize::from(face.corners)];
            corners.iter().map(view).collect()
        })
    }
}

/// Counts how often each pixel was written, and owns a page to write to.
#[derive(Debug)]
pub struct PixelCounter {
    times: Vec<u8>,
    page: Box<PlanarBuffer>,
}

impl Default for PixelCounter {
    fn default() -> Self {
        Self {
            times: vec![0; WIDTH * HEIGHT],
            page: Box::new(PlanarBuffer::new()),
        }
    }
}

impl PixelCounter {
    /// Returns the number of pixels never written, and of pixels written more than once.
    pub fn gaps_and_doubles(&self) -> (usize, usize) {
        let count = |wrong: fn(u8) -> bool| self.times.iter().filter(|&&n| wrong(n)).count();
        (count(|n| n == 0), count(|n| n > 1))
    }

    /// Returns how often pixel `i` was written. Pixels are numbered along the rows from the upper left.
    pub fn times(&self, i: usize) -> u8 {
        self.times[i]
    }

    /// Returns the first pixel whose count is wrong, with the count.
    fn first(&self, mut wrong: impl FnMut(usize, u8) -> bool) -> Option<(i32, i32, u8)> {
        let mut all = self.times.iter().enumerate();
        let (i, &times) = all.find(|&(i, &times)| wrong(i, times))?;
        Some(((i % WIDTH) as i32, (i / WIDTH) as i32, times))
    }

    /// Clears the counts and draws a solid.
    pub fn draw(&mut self, memory: &mut RenderMemory, solid: &Solid, pose: &Pose) -> Stats {
        solid.with_renderer(memory, |renderer| {
            self.redraw(renderer, pose, RenderOptions::default())
        })
    }

    /// Clears the counts and draws the renderer's solid.
    pub fn redraw(
        &mut self,
        renderer: &mut SceneRenderer<'_>,
        pose: &Pose,
        options: RenderOptions,
    ) -> Stats {
        self.times.fill(0);
        renderer.draw(pose, options, self).stats
    }
}

impl Destination for PixelCounter {
    fn select(&mut self, _: u16) {}

    fn lane<const STEP: usize>(
        &mut self,
        x: u16,
        y: u16,
        len: u16,
        draw: impl FnOnce(Lane<'_, STEP>),
    ) {
        for i in 0..usize::from(len) {
            // The next byte of a plane is the fourth pixel further in the row.
            let along = i * STEP / STRIDE * WIDTH + i * STEP % STRIDE * 4;
            let times = &mut self.times[usize::from(y) * WIDTH + usize::from(x) + along];
            *times = times.saturating_add(1);
        }
        self.page.lane(x, y, len, draw);
    }
}

/// A solid's shape. Lengths are those of [`Solid::stretched`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Shape {
    /// [`Solid::ball`].
    Ball(Vec<i32>),
    /// [`Solid::octahedron`].
    Octahedron(Vec<i32>),
    /// [`Solid::cuboid`] of half sides, seen from a point inside.
    Cuboid(Vec3, Vec3),
}

/// The eye's place, which decides the properties that must hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Eye {
    /// The solid's front and back cover the same pixels equally often, so the front leaves no gap. Each pixel
    /// is written once, or lies in a fold. A fold arises where snapping, or the earlier rounding of corners,
    /// turns over a facet at the silhouette: the facet then overlaps its neighbour by 1/256 pixel, and both
    /// cover a pixel whose centre lies in the overlap. No rule for single polygons can detect that, and
    /// culling by the exact area would leave a gap.
    Outside,
    /// Each pixel is written once.
    Inside,
    /// Each face covers the pixels whose lines of sight meet it, except within 1/128 pixel of an edge.
    /// Snapping moves a vertex by up to 1/512 pixel in x and y.
    Anywhere,
}

/// A case: a solid, its pose and the eye's place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SolidCase {
    /// The solid.
    pub shape: Shape,
    /// The solid's pose.
    pub pose: Pose,
    /// The eye's place.
    pub eye: Eye,
}

impl SolidCase {
    fn solid(&self) -> Solid {
        match &self.shape {
            Shape::Ball(lengths) => Solid::ball().stretched(lengths),
            Shape::Octahedron(lengths) => Solid::octahedron().stretched(lengths),
            Shape::Cuboid(half, eye) => Solid::cuboid(*half).seen_from(*eye),
        }
    }

    /// Returns the source of a test with the case, for `kernel/render/tests/clips.rs`; `from` says where it
    /// was found.
    pub fn source(&self, wrong: &SolidError, from: impl fmt::Display) -> String {
        let Self { shape, pose, eye } = self;
        let shape = match shape {
            Shape::Ball(lengths) => format!("Ball(vec!{lengths:?})"),
            Shape::Octahedron(lengths) => format!("Octahedron(vec!{lengths:?})"),
            Shape::Cuboid(..) => format!("{shape:?}"),
        };
        format!(
            "/// {wrong}. Found by {from}.\n#[test]\nfn found_by_a_sweep() {{\n    \
             use oracle::solid::{{SolidCase, SolidChecker, Eye, Shape}};\n    \
             let case = SolidCase {{\n        shape: Shape::{shape},\n        pose: {pose:?},\n        \
             eye: Eye::{eye:?},\n    }};\n    \
             assert_eq!(SolidChecker::default().case(&case).err(), None);\n}}\n"
        )
    }
}

/// A kind of solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SolidMix {
    /// The ball from outside, with a radius from a twentieth of a pixel upward.
    Ball,
    /// A cube from outside.
    Cube,
    /// An octahedron from outside.
    Octahedron,
    /// The ball from inside.
    InBall,
    /// Boxes from inside, about half of them with the eye as near to a face as allowed.
    InBox,
    /// Balls and octahedra with vertices at any distance, from inside.
    InCrag,
    /// Octahedra with vertices at any distance, with the eye anywhere: cut by the near plane and by the guard
    /// band.
    Anywhere,
}

impl SolidMix {
    /// All mixes.
    pub const ALL: [Self; 7] = [
        Self::Ball,
        Self::Cube,
        Self::Octahedron,
        Self::InBall,
        Self::InBox,
        Self::InCrag,
        Self::Anywhere,
    ];

    /// Returns the mix's name in the tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ball => "ball from outside",
            Self::Cube => "cube from outside",
            Self::Octahedron => "octahedron from outside",
            Self::InBall => "ball from inside",
            Self::InBox => "boxes from inside",
            Self::InCrag => "crags from inside",
            Self::Anywhere => "crags from anywhere",
        }
    }

    /// Returns case `number` of this mix.
    pub fn case(self, seed: u64, number: u64) -> SolidCase {
        let mut random = stream(seed, 64 + self as u64, number);
        let random = &mut random;
        match self {
            Self::Ball => from_outside(random, UNIT, |scale| Shape::Ball(vec![scale])),
            // The cube's corners are at the square root of three.
            Self::Cube => from_outside(random, 113_513, |scale| Shape::Cuboid([scale; 3], [0; 3])),
            Self::Octahedron => from_outside(random, UNIT, |scale| Shape::Octahedron(vec![scale])),
            Self::InBall => {
                // The ball's faces are nowhere nearer than 0.98 to its centre.
                let distance = random.i32(0..UNIT / 100 * 97);
                SolidCase {
                    shape: Shape::Ball(vec![UNIT]),
                    pose: pose(random, distance),
                    eye: Eye::Inside,
                }
            }
            Self::InBox => {
                let half = [0; 3].map(|_| length(random) / 2);
                let eye = half.map(|half| {
                    let most = half - 257;
                    match random.u8(0..9) {
                        0 => most,
                        1 => -most,
                        _ => random.i32(-most..=most),
                    }
                });
                SolidCase {
                    shape: Shape::Cuboid(half, eye),
                    pose: pose(random, 0),
                    eye: Eye::Inside,
                }
            }
            Self::InCrag => {
                let shape = if random.u8(0..3) == 0 {
                    let lengths = Solid::ball().vertices;
                    let lengths = lengths.iter().map(|_| random.i32(1 << 14..1 << 18));
                    Shape::Ball(lengths.collect())
                } else {
                    Shape::Octahedron((0..6).map(|_| length(random)).collect())
                };
                SolidCase {
                    shape,
                    pose: pose(random, 0),
                    eye: Eye::Inside,
                }
            }
            Self::Anywhere => {
                // From half the near plane's distance; every magnitude is equally likely.
                let mut any = || {
                    let bits = random.u32(6..22);
                    random.i32(1 << bits..=2 << bits)
                };
                let lengths = (0..6).map(|_| any()).collect();
                let distance = any();
                let distance = random.choice([0, distance]).unwrap_or(0);
                SolidCase {
                    shape: Shape::Octahedron(lengths),
                    pose: pose(random, distance),
                    eye: Eye::Anywhere,
                }
            }
        }
    }
}

fn from_outside(random: &mut Rng, reach: i32, shape: impl Fn(i32) -> Shape) -> SolidCase {
    let shift = random.choice([0, 3, 6]).unwrap_or(0);
    let distance = if random.u8(0..8) == 0 {
        // With room for the rounding of the turn.
        (reach >> shift) + 260 + random.i32(0..UNIT / 4)
    } else {
        let bits = random.u32(17..23);
        random.i32(1 << bits..=(2 << bits).min(Pose::MAX_DISTANCE))
    };
    SolidCase {
        shape: shape(UNIT >> shift),
        pose: pose(random, distance),
        eye: Eye::Outside,
    }
}

/// Returns random angles at a distance. A fifth of the angles are multiples of an eighth of a turn, where
/// faces are edge-on or fill the screen.
pub fn pose(random: &mut Rng, distance: i32) -> Pose {
    let mut angle = || {
        if random.u8(0..5) == 0 {
            random.u32(0..8) << 29
        } else {
            random.u32(..)
        }
    };
    Pose {
        yaw: angle(),
        pitch: angle(),
        roll: angle(),
        distance,
    }
}

/// From 1/64 unit to 64 units; every magnitude is equally likely.
pub fn length(random: &mut Rng) -> i32 {
    let bits = random.u32(10..22);
    random.i32(1 << bits..=2 << bits)
}

/// A reason why a case fails.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SolidError {
    /// Drawing it panicked.
    Panicked,
    /// This many faces were dropped.
    Dropped(u32),
    /// The pixel was written this many times instead of once, and lies in no fold.
    Times(i32, i32, u8),
    /// The solid's front and back did not write the pixel equally often.
    Sides(i32, i32),
    /// The face with these corners covers the pixel although its line of sight misses the face, or the
    /// reverse. The last number is the distance to the nearest edge in 1/1000 pixel.
    Sight(i32, i32, Vec<Vec3>, u32),
}

impl fmt::Display for SolidError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Panicked => write!(f, "the renderer panicked"),
            Self::Dropped(faces) => write!(f, "{faces} faces were dropped"),
            Self::Times(x, y, times) => write!(f, "({x}, {y}) was written {times} times, not once"),
            Self::Sides(x, y) => write!(f, "front and back did not write ({x}, {y}) equally often"),
            Self::Sight(x, y, corners, off) => {
                let (pixels, rest) = (off / 1000, off % 1000);
                write!(
                    f,
                    "({x}, {y}), {pixels}.{rest:03} pixel from an edge, is drawn unlike its line of sight to \
                     the face {corners:?}"
                )
            }
        }
    }
}

impl std::error::Error for SolidError {}

/// Counts of the comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SolidCounts {
    /// Faces drawn, or compared.
    pub faces: u64,
    /// Pixels compared.
    pub pixels: u64,
    /// Compared pixels that lie in a fold ([`Eye::Outside`]).
    pub folds: u64,
    /// Faces on the screen that the near plane or the guard band cut ([`Eye::Anywhere`]).
    pub cut: [u64; 2],
    /// Pixels from which the near plane alone removed a face.
    pub cut_away: u64,
    /// Pixels that snapping moved to the other side of an edge.
    pub changed: u64,
    /// The largest distance of a changed pixel from its edge, in pixels.
    pub furthest: f64,
}

impl std::ops::AddAssign for SolidCounts {
    fn add_assign(&mut self, more: Self) {
        self.faces += more.faces;
        self.pixels += more.pixels;
        self.folds += more.folds;
        self.cut = [0, 1].map(|k| self.cut[k] + more.cut[k]);
        self.cut_away += more.cut_away;
        self.changed += more.changed;
        self.furthest = self.furthest.max(more.furthest);
    }
}

/// Largest distance from a true edge at which a pixel may lie on the other side.
const SNAPPED: f64 = 1.0 / 128.0;

/// Checks cases, and owns the memory for the checks.
#[derive(Debug)]
pub struct SolidChecker {
    memory: InPlace<RenderMemory>,
    front: PixelCounter,
    back: PixelCounter,
    covered: Pixels,
}

impl Default for SolidChecker {
    fn default() -> Self {
        Self {
            memory: in_place::boxed!(RenderMemory),
            front: PixelCounter::default(),
            back: PixelCounter::default(),
            covered: Pixels::default(),
        }
    }
}

impl SolidChecker {
    /// Checks a case, and returns the counts of the comparison.
    ///
    /// # Errors
    /// The first error found.
    pub fn case(&mut self, case: &SolidCase) -> Result<SolidCounts, SolidError> {
        let (solid, pose) = (case.solid(), &case.pose);
        // A panic counts as a failure, so that the case is printed.
        let check = AssertUnwindSafe(|| match case.eye {
            Eye::Outside => self.seen_from_outside(&solid, pose),
            Eye::Inside => self.seen_from_inside(&solid.inside_out(), pose),
            Eye::Anywhere => {
                let mut compared = self.by_sight(&solid, pose)?;
                compared += self.by_sight(&solid.inside_out(), pose)?;
                Ok(compared)
            }
        });
        catch_unwind(check).unwrap_or(Err(SolidError::Panicked))
    }

    fn seen_from_inside(&mut self, solid: &Solid, pose: &Pose) -> Result<SolidCounts, SolidError> {
        let stats = self.front.draw(&mut self.memory, solid, pose);
        none_dropped(stats)?;
        match self.front.first(|_, times| times != 1) {
            Some((x, y, times)) => Err(SolidError::Times(x, y, times)),
            None => Ok(SolidCounts {
                faces: stats.polygons.into(),
                pixels: (WIDTH * HEIGHT) as u64,
                ..SolidCounts::default()
            }),
        }
    }

    fn seen_from_outside(&mut self, solid: &Solid, pose: &Pose) -> Result<SolidCounts, SolidError> {
        let turned = solid.clone().inside_out();
        let fronts = self.front.draw(&mut self.memory, solid, pose);
        let backs = self.back.draw(&mut self.memory, &turned, pose);
        none_dropped(fronts)?;
        none_dropped(backs)?;
        let back = &self.back.times;
        if let Some((x, y, _)) = self.front.first(|i, times| times != back[i]) {
            return Err(SolidError::Sides(x, y));
        }
        let mut folds = 0;
        if let Some((x, y, times)) = self.front.first(|i, times| {
            let (x, y) = ((i % WIDTH) as i32, (i / WIDTH) as i32);
            let fold = times > 1
                && [solid, &turned]
                    .into_iter()
                    .any(|solid| is_in_fold(&mut self.memory, solid, pose, x, y));
            folds += u64::from(fold);
            times > 1 && !fold
        }) {
            return Err(SolidError::Times(x, y, times));
        }
        Ok(SolidCounts {
            faces: (fronts.polygons + backs.polygons).into(),
            pixels: self.front.times.iter().filter(|&&times| times > 0).count() as u64,
            folds,
            ..SolidCounts::default()
        })
    }

    /// Compares each front face of a solid separately with lines of sight.
    ///
    /// # Errors
    /// The first error found.
    pub fn by_sight(&mut self, solid: &Solid, pose: &Pose) -> Result<SolidCounts, SolidError> {
        let mut drawn = Vec::new();
        let mut dropped = 0;
        solid.with_renderer(&mut self.memory, |renderer| {
            renderer.at(pose).faces(|_, face| match face {
                Some(face) => drawn.push((
                    face.anchors.map(|anchor| anchor.position),
                    face.polygon
                        .iter()
                        .map(|&v| v.into())
                        .collect::<Vec<Point>>(),
                )),
                None => dropped += 1,
            });
        });
        if dropped > 0 {
            return Err(SolidError::Dropped(dropped));
        }
        let mut drawn = drawn.into_iter().peekable();
        let mut compared = SolidCounts::default();
        for corners in solid.views(pose) {
            let polygon = drawn.next_if(|(positions, _)| *positions == anchors(&corners));
            let polygon = polygon.map(|(_, polygon)| polygon);
            compared += self.face(&corners, polygon.as_deref())?;
        }
        assert!(
            drawn.next().is_none(),
            "a drawn face is not a face of the solid"
        );
        Ok(compared)
    }

    fn face(
        &mut self,
        corners: &[Vec3],
        polygon: Option<&[Point]>,
    ) -> Result<SolidCounts, SolidError> {
        let face = sight::ViewFace::new(corners);
        let mut compared = SolidCounts {
            faces: 1,
            ..SolidCounts::default()
        };
        let area = match polygon {
            Some(polygon) => Area::around(polygon),
            None if !face.looks_at_eye() || face.is_beside_screen() => return Ok(compared),
            None => Area {
                x: 0..WIDTH as i32,
                y: 0..HEIGHT as i32,
            },
        };
        let polygon = polygon.unwrap_or_default();
        self.covered.cover(polygon, &area);
        compared.pixels = area.pixels();
        let mut seen = false;
        for y in area.y.clone() {
            let (between, met) = face.row(y, area.x.clone());
            seen |= !met.is_empty();
            compared.cut_away += (between.len() - met.len()) as u64;
            // The pixels that differ remain.
            self.covered.toggle_from(met.start, y);
            self.covered.toggle_from(met.end, y);
            if *self.covered.row(y) == Row::default() {
                continue;
            }
            for x in area.x.clone().filter(|&x| self.covered.contains(x, y)) {
                let distance = face.distance(x, y);
                if distance > SNAPPED {
                    let off = (distance * 1000.0) as u32;
                    return Err(SolidError::Sight(x, y, corners.to_vec(), off));
                }
                compared.changed += 1;
                compared.furthest = compared.furthest.max(distance);
            }
        }
        let at_guard = |p: &Point| p.x.abs().max(p.y.abs()) == MAX_COORDINATE;
        compared.cut = [
            corners.iter().any(|corner| corner[2] < NEAR),
            polygon.iter().any(at_guard),
        ]
        .map(|cut| u64::from(seen && cut));
        Ok(compared)
    }
}

/// Returns the corners of a face that [`texmap::Face`] has as anchors; they identify the face.
fn anchors(corners: &[Vec3]) -> [Vec3; 3] {
    [0, 1, 2].map(|i| corners[i * corners.len() / 3])
}

fn none_dropped(stats: Stats) -> Result<(), SolidError> {
    match stats.dropped {
        0 => Ok(()),
        faces => Err(SolidError::Dropped(faces)),
    }
}

/// Largest distance by which rounding moves a corner of a convex solid, in 2^-16 unit. Along each axis the
/// mesh adds a half, [`Solid::stretched`] one and turning a half.
const ROUNDED: f64 = 2.0 * 1.733;

/// Returns whether the drawn pixel is covered by a face that rounding may have turned over.
fn is_in_fold(memory: &mut RenderMemory, solid: &Solid, pose: &Pose, x: i32, y: i32) -> bool {
    let mut covering = Vec::new();
    solid.with_renderer(memory, |renderer| {
        renderer.at(pose).faces(|_, drawn| {
            let drawn = drawn.into_iter();
            covering.extend(drawn.filter_map(|drawn| {
                let polygon: Vec<Point> = drawn.polygon.iter().map(|&v| v.into()).collect();
                let anchors = drawn.anchors.map(|anchor| anchor.position);
                inside(&polygon, x, y).then_some(anchors)
            }));
        });
    });
    solid.views(pose).any(|corners| {
        let z = corners.iter().map(|corner| corner[2]).max();
        let snapped = f64::from(z.unwrap_or(0)) / f64::from(512 * FOCAL_LENGTH);
        let by = ROUNDED + snapped * std::f64::consts::SQRT_2;
        covering.contains(&anchors(&corners)) && sight::ViewFace::new(&corners).is_edge_on(by)
    })
}
