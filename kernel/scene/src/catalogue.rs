//! Every built-in scene by name: the ball, and the scenes that mappers are measured with.
//!
//! Each of the latter asks one question of a mapper. They share the ball's palette and light.
//!
//! A solid that is loaded is an [`Entry`] as well, and whoever shows scenes need not know which
//! ones are built in.

use core::ops::Deref;

use modex::{HEIGHT, Palette};
use texmap::Texture;

use crate::ball::{self, TEXELS, paint_ball};
use crate::colour::{BACKGROUND, LEVEL_BACKGROUND, LIGHT_TABLE, PALETTE};
use crate::surfaces::{self, SIDE};
use crate::trig::sin;
use crate::{Corner, Face, LightTable, MAX_EXTENT, Mesh, Pose, Scene, Vec3};
use crate::{corridor, knot};

/// Texels of the largest texture in the catalogue: the memory that [`Entry::paint`] is lent.
pub const MAX_TEXELS: usize = SIDE * SIDE;
const _: () = assert!(TEXELS <= MAX_TEXELS);

/// A scene by name.
#[derive(Clone, Copy, Debug)]
pub struct Entry<'a> {
    /// Its name: small letters, digits and hyphens.
    pub name: &'static str,
    /// A line about it, for people.
    pub about: &'static str,
    mesh: Mesh<'a>,
    colours: Colours<'a>,
    background: &'a [u8; HEIGHT],
    cover: Cover<'a>,
    mipmaps: bool,
    pose: fn(u32) -> Pose,
    /// By how much nearer all looks the same again, 16.16 units; 0 if it does not.
    tile: i32,
}

/// The DAC's colours, and what they become in the light.
#[derive(Clone, Copy, Debug)]
pub struct Colours<'a> {
    /// The DAC's colours.
    pub palette: &'a Palette,
    /// What a texel becomes at a light level.
    pub light: &'a LightTable,
}

impl Colours<'static> {
    /// Of all that is built in.
    pub const BUILT_IN: Self = Self {
        palette: &PALETTE,
        light: &LIGHT_TABLE,
    };
}

/// Most textures of an entry.
const MAX_TEXTURES: usize = 2;

/// An entry's textures.
#[derive(Clone, Copy, Debug)]
pub struct Textures<'t> {
    all: [Texture<'t>; MAX_TEXTURES],
    len: usize,
}

impl<'t> Deref for Textures<'t> {
    type Target = [Texture<'t>];

    fn deref(&self) -> &Self::Target {
        &self.all[..self.len]
    }
}

impl<'t> From<Texture<'t>> for Textures<'t> {
    fn from(texture: Texture<'t>) -> Self {
        Self {
            all: [texture; MAX_TEXTURES],
            len: 1,
        }
    }
}

impl<'t> From<[Texture<'t>; MAX_TEXTURES]> for Textures<'t> {
    fn from(all: [Texture<'t>; MAX_TEXTURES]) -> Self {
        Self {
            all,
            len: MAX_TEXTURES,
        }
    }
}

/// Where an entry's textures come from.
#[derive(Clone, Copy, Debug)]
enum Cover<'a> {
    /// They are painted by code.
    Painted(for<'m> fn(&'m mut [u8; MAX_TEXELS]) -> Textures<'m>),
    /// It is there.
    Loaded(Texture<'a>),
}

impl<'a> Entry<'a> {
    /// The name of a solid that was loaded; no built-in scene has it.
    pub const LOADED: &'static str = "model";

    /// A solid that was loaded. It turns as the ball does.
    pub fn loaded(
        mesh: Mesh<'a>,
        texture: Texture<'a>,
        colours: Colours<'a>,
        background: &'a [u8; HEIGHT],
    ) -> Self {
        Self {
            name: Self::LOADED,
            about: "the model that was loaded with the image",
            mesh,
            colours,
            background,
            cover: Cover::Loaded(texture),
            mipmaps: false,
            pose: Pose::at_tick,
            tile: 0,
        }
    }

    /// Its textures in full light; what has to be painted is painted into `texels`.
    pub fn paint<'m>(&self, texels: &'m mut [u8; MAX_TEXELS]) -> Textures<'m>
    where
        'a: 'm,
    {
        match self.cover {
            Cover::Painted(paint) => paint(texels),
            Cover::Loaded(texture) => texture.into(),
        }
    }

    /// The scene. `textures` holds what [`Entry::paint`] gave.
    pub fn scene<'t>(&self, textures: &'t [Texture<'t>]) -> Scene<'a, 't>
    where
        'a: 't,
    {
        Scene {
            name: self.name,
            mesh: self.mesh,
            textures,
            palette: self.colours.palette,
            light: self.colours.light,
            background: self.background,
            mipmaps: self.mipmaps,
        }
    }

    /// The default pose at a tick: frame N of the scene is its pose at tick N.
    pub fn pose(&self, tick: u32) -> Pose {
        (self.pose)(tick)
    }

    /// A pose that looks as `next` does, at the distance that is nearest to that of `pose`.
    ///
    /// A walk along tiles goes on from a tile's end at the beginning of the same one. Nothing is seen
    /// of that in the two pictures; but whoever asks how far it is from one pose to the next would be
    /// told of a leap back.
    pub fn following(&self, pose: &Pose, next: Pose) -> Pose {
        if self.tile == 0 {
            return next;
        }
        let leap = next.distance - pose.distance;
        let tiles = (leap + self.tile / 2).div_euclid(self.tile);
        let distance = (next.distance - tiles * self.tile).clamp(0, Pose::MAX_DISTANCE);
        Pose { distance, ..next }
    }
}

impl Entry<'static> {
    /// The built-in scene of a name.
    pub fn parse(name: &str) -> Option<&'static Self> {
        CATALOGUE.iter().find(|entry| entry.name == name)
    }
}

/// Every built-in scene, the ball first.
pub static CATALOGUE: [Entry<'static>; 10] = [
    Entry {
        name: "ball",
        about: "the globe of flat facets: many small polygons, short runs",
        mesh: ball::MESH,
        colours: Colours::BUILT_IN,
        background: &BACKGROUND,
        cover: Cover::Painted(|texels| {
            let (texels, _) = texels.split_at_mut(TEXELS);
            paint_ball(texels.try_into().expect("it was cut to TEXELS")).into()
        }),
        mipmaps: false,
        pose: Pose::at_tick,
        tile: 0,
    },
    Entry {
        name: "facing",
        about: "a square that faces the viewer and turns: no perspective at all",
        mesh: SQUARE,
        colours: Colours::BUILT_IN,
        background: &BACKGROUND,
        cover: Cover::Painted(|texels| surfaces::paint(texels, surfaces::dial).into()),
        mipmaps: false,
        pose: |tick| Pose {
            yaw: turn(tick),
            pitch: QUARTER,
            roll: 0,
            distance: units(23, 10),
        },
        tile: 0,
    },
    Entry {
        name: "tilted",
        about: "the square at 45 degrees to the line of sight, turning in its plane",
        mesh: SQUARE,
        colours: Colours::BUILT_IN,
        background: &BACKGROUND,
        cover: Cover::Painted(|texels| surfaces::paint(texels, surfaces::board).into()),
        mipmaps: false,
        pose: |tick| Pose {
            yaw: turn(tick).wrapping_add(25 * DEGREE),
            pitch: QUARTER / 2,
            roll: 0,
            distance: units(23, 10),
        },
        tile: 0,
    },
    Entry {
        name: "grazing-16",
        about: "a floor to the horizon, sixteen times as far away there as at its near edge",
        mesh: FLOOR_16,
        colours: Colours::BUILT_IN,
        background: &LEVEL_BACKGROUND,
        cover: Cover::Painted(|texels| surfaces::paint(texels, surfaces::board).into()),
        mipmaps: false,
        pose: |tick| Pose {
            yaw: 0,
            pitch: 0,
            roll: sway(tick, 10),
            distance: FAR_16 - FLOOR_16_HALF,
        },
        tile: 0,
    },
    Entry {
        name: "grazing-4096",
        about: "a floor from under the eye to the horizon: 4096 times as far away there",
        mesh: FLOOR_4096,
        colours: Colours::BUILT_IN,
        background: &LEVEL_BACKGROUND,
        cover: Cover::Painted(|texels| surfaces::paint(texels, surfaces::plain).into()),
        mipmaps: false,
        pose: |tick| Pose {
            yaw: 0,
            pitch: 0,
            roll: sway(tick, 10),
            distance: FAR_4096 - FLOOR_4096_HALF,
        },
        tile: 0,
    },
    Entry {
        name: "wall",
        about: "a wall that runs away from the viewer: constant depth down each column",
        mesh: WALL,
        colours: Colours::BUILT_IN,
        background: &LEVEL_BACKGROUND,
        cover: Cover::Painted(|texels| surfaces::paint(texels, surfaces::bricks).into()),
        mipmaps: false,
        pose: |tick| Pose {
            yaw: sway(tick, 12).wrapping_add(52 * DEGREE),
            pitch: 0,
            roll: 0,
            distance: units(21, 10),
        },
        tile: 0,
    },
    Entry {
        name: "cube",
        about: "a crate that tumbles and comes close to the eye",
        mesh: CUBE,
        colours: Colours::BUILT_IN,
        background: &BACKGROUND,
        cover: Cover::Painted(|texels| surfaces::paint(texels, surfaces::crate_side).into()),
        mipmaps: false,
        pose: |tick| Pose {
            yaw: turn(tick).wrapping_add(35 * DEGREE),
            pitch: turn(tick / 2).wrapping_add(30 * DEGREE),
            roll: turn(tick / 3),
            // 2.25 to 4.25 units: its corners are 1.73 from the middle.
            distance: units(13, 4) - (sin(turn(tick)) >> 14) as i32,
        },
        tile: 0,
    },
    Entry {
        name: "knot",
        about: "a tube tied in a trefoil: parts of it hide others",
        mesh: knot::MESH,
        colours: Colours::BUILT_IN,
        background: &BACKGROUND,
        cover: Cover::Painted(|texels| knot::paint(texels).into()),
        mipmaps: false,
        pose: |tick| Pose {
            yaw: turn(tick).wrapping_mul(2).wrapping_neg(),
            pitch: (70 * DEGREE).wrapping_add(turn(tick)),
            roll: 20 * DEGREE,
            distance: units(31, 10),
        },
        tile: 0,
    },
    Entry {
        name: "corridor",
        about: "a walk between two walls: tiled textures, a mipmap for each distance",
        mesh: corridor::MESH,
        colours: Colours::BUILT_IN,
        background: &LEVEL_BACKGROUND,
        cover: Cover::Painted(corridor::paint),
        mipmaps: true,
        pose: stroll,
        tile: TILE,
    },
    Entry {
        name: "moire",
        about: "the same walk without mipmaps: what is far away shimmers",
        mesh: corridor::MESH,
        colours: Colours::BUILT_IN,
        background: &LEVEL_BACKGROUND,
        cover: Cover::Painted(corridor::paint),
        mipmaps: false,
        pose: stroll,
        tile: TILE,
    },
];

const DEGREE: u32 = ((1u64 << 32) / 360) as u32;
const QUARTER: u32 = 1 << 30;

/// `n / d` units in 16.16.
const fn units(n: i32, d: i32) -> i32 {
    n * (1 << 16) / d
}

/// A steady turn in 12 s.
const fn turn(tick: u32) -> u32 {
    tick.wrapping_mul(((1u64 << 32) / 720) as u32)
}

/// Up to `degrees` to either side and back in 12 s. At tick 0 it is on its way, so that nothing
/// is level.
fn sway(tick: u32, degrees: u32) -> u32 {
    let sine = sin(turn(tick).wrapping_add(QUARTER / 2));
    ((sine * i64::from(degrees * DEGREE)) >> 30) as u32
}

/// A tile of the corridor's floor and walls, 16.16 units.
const TILE: i32 = 1 << 16;

/// A tile of the corridor forward in three quarters of a second, and a look to either side: seamless,
/// since all tiles are alike.
fn stroll(tick: u32) -> Pose {
    const TICKS: u32 = 45;
    Pose {
        yaw: sway(tick, 9),
        pitch: 0,
        roll: sway(tick.wrapping_mul(2), 1),
        distance: units(3, 1) - (tick % TICKS) as i32 * TILE / TICKS as i32,
    }
}

/// A square that lies `y` below the eye, `half` to either side and as far to the front and back.
/// The texture's top is far away, so that writing is read from the near edge.
const fn lying(half: i32, y: i32) -> [Vec3; 4] {
    [
        [-half, y, half],
        [half, y, half],
        [half, y, -half],
        [-half, y, -half],
    ]
}

/// The whole texture on four vertices from `first` on, clockwise from its top left.
const fn corners<const N: usize>() -> [Corner; N] {
    let side = (SIDE as i32) << 16;
    let places = [(0, 0), (side, 0), (side, side), (0, side)];
    let mut corners = [Corner {
        vertex: 0,
        u: 0,
        v: 0,
    }; N];
    let mut i = 0;
    while i < N {
        corners[i] = Corner {
            vertex: i as u16,
            u: places[i % 4].0,
            v: places[i % 4].1,
        };
        i += 1;
    }
    corners
}

/// A face of four corners.
const fn face(first: u16, normal: Vec3) -> Face {
    Face {
        first,
        corners: 4,
        texture: 0,
        normal,
    }
}

/// One, with a normal's 14 fraction bits.
const ONE: i32 = 1 << 14;
static ONE_FACE: [Corner; 4] = corners();
static UPWARD: [Face; 1] = [face(0, [0, -ONE, 0])];

const fn lies(vertices: &'static [Vec3]) -> Mesh<'static> {
    Mesh {
        vertices,
        corners: &ONE_FACE,
        faces: &UPWARD,
        convex: true,
    }
}

static SQUARE_VERTICES: [Vec3; 4] = lying(units(1, 1), 0);
const SQUARE: Mesh<'static> = lies(&SQUARE_VERTICES);

/// How far away a floor's far edge is: as far as an edge may be, but for the floor's own middle.
const FAR_16: i32 = 128 << 16;
/// The near edge is at a sixteenth of it, below the screen.
const FLOOR_16_HALF: i32 = (FAR_16 - FAR_16 / 16) / 2;
static FLOOR_16_VERTICES: [Vec3; 4] = lying(FLOOR_16_HALF, units(21, 4));
const FLOOR_16: Mesh<'static> = lies(&FLOOR_16_VERTICES);

const FAR_4096: i32 = 128 << 16;
const FLOOR_4096_HALF: i32 = (FAR_4096 - FAR_4096 / 4096) / 2;
static FLOOR_4096_VERTICES: [Vec3; 4] = lying(FLOOR_4096_HALF, units(3, 4));
const FLOOR_4096: Mesh<'static> = lies(&FLOOR_4096_VERTICES);
const _: () = assert!(FLOOR_16_HALF < MAX_EXTENT && FLOOR_4096_HALF < MAX_EXTENT);

static WALL_VERTICES: [Vec3; 4] = {
    let half = units(3, 2);
    [
        [-half, -half, 0],
        [half, -half, 0],
        [half, half, 0],
        [-half, half, 0],
    ]
};
static TOWARDS: [Face; 1] = [face(0, [0, 0, -ONE])];
const WALL: Mesh<'static> = Mesh {
    vertices: &WALL_VERTICES,
    corners: &ONE_FACE,
    faces: &TOWARDS,
    convex: true,
};

/// Four vertices a side: front, right, back, left, top, bottom, each clockwise from its texture's
/// top left as it is seen from outside.
#[rustfmt::skip]
static CUBE_VERTICES: [Vec3; 24] = {
    const A: i32 = -units(1, 1);
    const B: i32 = units(1, 1);
    [
        [A, A, A], [B, A, A], [B, B, A], [A, B, A],
        [B, A, A], [B, A, B], [B, B, B], [B, B, A],
        [B, A, B], [A, A, B], [A, B, B], [B, B, B],
        [A, A, B], [A, A, A], [A, B, A], [A, B, B],
        [A, A, B], [B, A, B], [B, A, A], [A, A, A],
        [A, B, A], [B, B, A], [B, B, B], [A, B, B],
    ]
};
static CUBE_CORNERS: [Corner; 24] = corners();
static CUBE_FACES: [Face; 6] = [
    face(0, [0, 0, -ONE]),
    face(4, [ONE, 0, 0]),
    face(8, [0, 0, ONE]),
    face(12, [-ONE, 0, 0]),
    face(16, [0, -ONE, 0]),
    face(20, [0, ONE, 0]),
];
const CUBE: Mesh<'static> = Mesh {
    vertices: &CUBE_VERTICES,
    corners: &CUBE_CORNERS,
    faces: &CUBE_FACES,
    convex: true,
};

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::colour::{RAMPS, Ramp, SHADES};
    use crate::{Stage, Storage};
    use modex::PlanarBuffer;
    use std::boxed::Box;
    use std::collections::{HashMap, HashSet};
    use std::vec::Vec;

    /// Ticks from all of a turn, of no regularity.
    const TICKS: [u32; 9] = [0, 1, 89, 180, 271, 360, 447, 540, 719];

    /// Calls `check` with an entry and a stage of it.
    fn staged(name: &str, check: impl FnOnce(&Entry<'_>, &mut Stage<'_>)) {
        let entry = Entry::parse(name).unwrap();
        let mut texels = Box::new([0; MAX_TEXELS]);
        let textures = entry.paint(&mut texels);
        let mut storage = in_place::boxed!(Storage);
        check(entry, &mut Stage::new(&mut storage, entry.scene(&textures)));
    }

    /// Of each vertex of a mesh at a tick, how far away it is.
    fn depths(entry: &Entry<'_>, tick: u32) -> Vec<i32> {
        let pose = entry.pose(tick);
        let orientation = pose.orientation();
        let depth = |&vertex| orientation.turn(vertex)[2] + pose.distance;
        entry.mesh.vertices.iter().map(depth).collect()
    }

    #[test]
    fn names_are_plain_and_no_two_alike() {
        let mut known = HashSet::new();
        for entry in &CATALOGUE {
            let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
            assert!(entry.name.chars().all(plain), "{}", entry.name);
            assert!(known.insert(entry.name), "{}", entry.name);
            assert_eq!(Entry::parse(entry.name).unwrap().name, entry.name);
        }
        assert!(Entry::parse("Ball").is_none());
        assert!(!known.contains(Entry::LOADED));
    }

    #[test]
    fn every_picture_is_whole_and_shows_its_scene() {
        for entry in &CATALOGUE {
            staged(entry.name, |entry, stage| {
                for tick in TICKS {
                    let mut page = PlanarBuffer::new();
                    let stats = stage.draw(&entry.pose(tick), &mut page);
                    assert_eq!(stats.dropped, 0, "{} at {tick}", entry.name);
                    let pixels = stats.pixels;
                    let some = (12_000..=76_800).contains(&pixels);
                    assert!(some, "{} at {tick}: {pixels} pixels", entry.name);
                }
            });
        }
    }

    #[test]
    fn textures_are_shades_that_light_can_move() {
        let mut texels = Box::new([0; MAX_TEXELS]);
        let mut seen = HashSet::new();
        for entry in &CATALOGUE {
            for texture in entry.paint(&mut texels).iter() {
                let ramp =
                    |&texel: &u8| usize::from(texel.wrapping_sub(Ramp::Violet.shade(0))) / SHADES;
                let ramps: HashSet<_> = texture.texels().iter().map(ramp).collect();
                assert!(ramps.iter().all(|&ramp| ramp < RAMPS), "{}", entry.name);
                assert!(ramps.len() > 2, "{} is dull", entry.name);
                seen.insert(texture.texels().to_vec());
            }
        }
        // A floor has the board of the tilted square, and the moire the corridor's two.
        assert_eq!(seen.len(), CATALOGUE.len() - 1);
    }

    #[test]
    fn floors_have_the_depth_ratios_of_their_names() {
        for (name, ratio) in [("grazing-16", 16), ("grazing-4096", 4096)] {
            let entry = Entry::parse(name).unwrap();
            for tick in TICKS {
                let depths = depths(entry, tick);
                let (near, far) = (depths.iter().min().unwrap(), depths.iter().max().unwrap());
                assert_eq!(near * ratio, *far, "{name} at {tick}");
            }
        }
    }

    #[test]
    fn the_facing_square_has_one_depth_and_the_wall_one_in_each_column() {
        let facing = Entry::parse("facing").unwrap();
        for tick in TICKS {
            let depths = depths(facing, tick);
            assert!(depths.iter().all(|&depth| depth == depths[0]), "{depths:?}");
        }
        staged("wall", |entry, stage| {
            for tick in TICKS {
                stage.polygons(&entry.pose(tick), |_, face| {
                    let plane = face.unwrap().plane();
                    assert_eq!((plane.a.down, plane.c.down), (0, 0), "at {tick}");
                    assert_ne!(plane.c.right, 0, "at {tick}");
                });
            }
        });
    }

    #[test]
    fn the_crate_is_closed_and_looks_outward() {
        let mut edges = HashMap::new();
        for face in CUBE.faces {
            let corners = &CUBE.corners[usize::from(face.first)..][..4];
            let places = [0, 1, 2, 3].map(|i| CUBE.vertices[usize::from(corners[i].vertex)]);
            for i in 0..4 {
                *edges.entry((places[i], places[(i + 1) % 4])).or_insert(0) += 1;
            }
            // The face lies one unit out along its normal.
            for place in places {
                let out: i32 = (0..3)
                    .map(|k| (place[k] >> 2) * (face.normal[k] >> 14))
                    .sum();
                assert_eq!(out, ONE);
            }
        }
        let both = |(a, b)| edges.get(&(b, a)) == Some(&1);
        assert!(edges.iter().all(|(&edge, &count)| count == 1 && both(edge)));
    }
}
