//! Whole solids at every distance: nothing dropped, and from inside no pixel left out or written
//! twice.

use modex::{Destination, HEIGHT, Lane, Palette, PlanarBuffer, STRIDE, WIDTH};
use scene::{
    Corner, Face, LIGHT_LEVELS, LightTable, MAX_CORNERS, MAX_EXTENT, Mesh, Pose, Scene, Stage,
    Storage, Vec3,
};
use texmap::{Stats, Texture};

/// How often each pixel was written, with a page to write to.
struct Count {
    times: Vec<u8>,
    page: PlanarBuffer,
}

impl Count {
    fn new() -> Box<Self> {
        Box::new(Self {
            times: vec![0; WIDTH * HEIGHT],
            page: PlanarBuffer::new(),
        })
    }

    /// Pixels never written, and pixels written more than once.
    fn gaps_and_doubles(&self) -> (usize, usize) {
        let count = |wrong: fn(u8) -> bool| self.times.iter().filter(|&&n| wrong(n)).count();
        (count(|n| n == 0), count(|n| n > 1))
    }
}

impl Destination for Count {
    fn select(&mut self, _: u16) {}

    fn lane<const STEP: usize>(
        &mut self,
        x: u16,
        y: u16,
        len: u16,
        draw: impl FnOnce(Lane<'_, STEP>),
    ) {
        assert_eq!(STEP, STRIDE, "columns alone are drawn");
        for row in y..y + len {
            let times = &mut self.times[usize::from(row) * WIDTH + usize::from(x)];
            *times = times.saturating_add(1);
        }
        self.page.lane(x, y, len, draw);
    }
}

/// A solid of one texture, owned.
#[derive(Clone, Debug)]
struct Solid {
    vertices: Vec<Vec3>,
    corners: Vec<Corner>,
    faces: Vec<Face>,
}

const TEXELS: u16 = 16;

impl Solid {
    /// The faces by their vertices, clockwise from outside.
    fn new(vertices: &[Vec3], faces: &[&[u16]]) -> Self {
        let mut solid = Self {
            vertices: vertices.to_vec(),
            corners: Vec::new(),
            faces: Vec::new(),
        };
        for face in faces {
            solid.faces.push(Face {
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

    /// A box of these half sides: bit k of a vertex is its sign along axis k.
    fn cuboid(half: Vec3) -> Self {
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

    /// The unit ball of the demo.
    fn ball() -> Self {
        let mut texels = Box::new([0; scene::TEXELS]);
        let textures = [scene::paint_ball(&mut texels)];
        let mesh = scene::ball(&textures).mesh;
        let mut solid = Self {
            vertices: mesh.vertices.to_vec(),
            corners: mesh.corners.to_vec(),
            faces: mesh.faces.to_vec(),
        };
        // Another texture: its places only have to be inside.
        for corner in &mut solid.corners {
            corner.u %= i32::from(TEXELS) << 16;
            corner.v %= i32::from(TEXELS) << 16;
        }
        solid
    }

    /// Every face turned over: what was seen from outside is seen from inside.
    fn inside_out(mut self) -> Self {
        for face in &self.faces {
            self.corners[usize::from(face.first)..][..usize::from(face.corners)].reverse();
        }
        self
    }

    /// Moved, so that `eye` is at the origin: at distance 0 it is the eye's place.
    fn seen_from(mut self, eye: Vec3) -> Self {
        for vertex in &mut self.vertices {
            *vertex = [0, 1, 2].map(|k| vertex[k] - eye[k]);
        }
        self
    }

    fn draw(&self, storage: &mut Storage, pose: &Pose) -> (Stats, Box<Count>) {
        let mut count = Count::new();
        let stats = self.on_stage(storage, |stage| stage.draw(pose, &mut *count));
        (stats, count)
    }

    fn on_stage<T>(&self, storage: &mut Storage, act: impl FnOnce(&mut Stage<'_>) -> T) -> T {
        static LIGHT: LightTable = [[1; 256]; LIGHT_LEVELS];
        static PALETTE: Palette = [[0; 3]; 256];
        static BACKGROUND: [u8; HEIGHT] = [0; HEIGHT];
        let texels = [0; TEXELS as usize * TEXELS as usize];
        let textures = [Texture::new(&texels, TEXELS, TEXELS).unwrap()];
        let scene = Scene {
            name: "test",
            mesh: Mesh {
                vertices: &self.vertices,
                corners: &self.corners,
                faces: &self.faces,
            },
            textures: &textures,
            palette: &PALETTE,
            light: &LIGHT,
            background: &BACKGROUND,
        };
        act(&mut Stage::new(storage, scene))
    }

    /// Asserts that from `pose`, inside the solid, each pixel is written once.
    #[track_caller]
    fn surrounds(&self, storage: &mut Storage, pose: &Pose) {
        let (stats, count) = self.draw(storage, pose);
        assert_eq!(stats.dropped, 0, "{pose:?} in {self:?}");
        assert_eq!(count.gaps_and_doubles(), (0, 0), "{pose:?} in {self:?}");
    }
}

fn random() -> fastrand::Rng {
    let seed = fastrand::u64(..);
    eprintln!("seed {seed}");
    fastrand::Rng::with_seed(seed)
}

fn pose(random: &mut fastrand::Rng, distance: i32) -> Pose {
    let mut angle = || {
        // A fifth lie along the axes, where faces are edge-on or fill the screen.
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

/// From 1/64 unit to 64 units, all sizes alike.
fn length(random: &mut fastrand::Rng) -> i32 {
    let bits = random.u32(10..22);
    random.i32(1 << bits..=2 << bits)
}

#[test]
fn at_every_distance_nothing_is_dropped() {
    let mut random = random();
    let mut storage = Box::new(Storage::new());
    let unit = 1 << 16;
    for solid in [
        Solid::ball(),
        Solid::cuboid([unit; 3]),
        Solid::cuboid([MAX_EXTENT; 3]),
        Solid::cuboid([MAX_EXTENT, 300, 20]),
        Solid::cuboid([1; 3]),
    ] {
        for solid in [solid.clone(), solid.inside_out()] {
            for i in 0..1500 {
                let distance = match i % 3 {
                    0 => random.i32(0..=Pose::MAX_DISTANCE),
                    1 => length(&mut random) * 2,
                    _ => random.i32(0..2 * unit),
                };
                let pose = pose(&mut random, distance);
                solid.on_stage(&mut storage, |stage| {
                    let mut page = PlanarBuffer::new();
                    let stats = stage.draw(&pose, &mut page);
                    assert_eq!(stats.dropped, 0, "{pose:?}");
                });
            }
        }
    }
}

#[test]
fn from_inside_a_box_each_pixel_is_written_once() {
    let mut random = random();
    let mut storage = Box::new(Storage::new());
    for _ in 0..3000 {
        let half = [0; 3].map(|_| length(&mut random) / 2);
        // Half of the boxes have the eye as near to a face as it may come.
        let eye = half.map(|half| {
            let most = half - 257;
            match random.u8(0..9) {
                0 => most,
                1 => -most,
                _ => random.i32(-most..=most),
            }
        });
        let solid = Solid::cuboid(half).inside_out().seen_from(eye);
        if solid
            .vertices
            .iter()
            .flatten()
            .all(|k| k.abs() <= MAX_EXTENT)
        {
            solid.surrounds(&mut storage, &pose(&mut random, 0));
        }
    }
}

#[test]
fn from_inside_the_ball_each_pixel_is_written_once() {
    let mut random = random();
    let mut storage = Box::new(Storage::new());
    let ball = Solid::ball().inside_out();
    for _ in 0..1000 {
        // Its faces are nowhere nearer than 0.98 to its middle.
        let distance = random.i32(0..(1 << 16) * 97 / 100);
        ball.surrounds(&mut storage, &pose(&mut random, distance));
    }
}

/// Any lengths along the rays to a closed surface's vertices make one that each ray from the eye
/// meets once.
#[test]
fn from_inside_a_crag_each_pixel_is_written_once() {
    let mut random = random();
    let mut storage = Box::new(Storage::new());
    let ball = Solid::ball().inside_out();
    let octahedron = {
        let axes = [0, 1, 2].map(|k| [0, 1, 2].map(|i| i32::from(i == k) << 16));
        let vertices: Vec<Vec3> = axes.iter().flat_map(|&a| [a, a.map(|k| -k)]).collect();
        let mut faces = Vec::new();
        for signs in 0..8u16 {
            let [x, y, z] = [signs & 1, 2 + (signs >> 1 & 1), 4 + (signs >> 2)];
            let odd = signs.count_ones() % 2 == 1;
            faces.push(if odd { [x, y, z] } else { [x, z, y] });
        }
        let faces: Vec<&[u16]> = faces.iter().map(|face| &face[..]).collect();
        Solid::new(&vertices, &faces).inside_out()
    };
    for i in 0..3000 {
        let mut crag = if i % 3 == 0 { &ball } else { &octahedron }.clone();
        for vertex in &mut crag.vertices {
            let length = if i % 3 == 0 {
                random.i32(1 << 14..1 << 18)
            } else {
                length(&mut random)
            };
            *vertex = vertex.map(|k| ((i64::from(k) * i64::from(length)) >> 16) as i32);
        }
        crag.surrounds(&mut storage, &pose(&mut random, 0));
    }
}

#[test]
fn the_eye_may_come_to_a_256th_of_a_unit_from_a_face() {
    let mut storage = Box::new(Storage::new());
    let unit = 1 << 16;
    let cube = Solid::cuboid([unit; 3]);
    let mut looking_on = |above: i32, roll: u32| {
        let pose = Pose {
            yaw: 0,
            pitch: 0,
            roll,
            distance: unit + above,
        };
        let (stats, count) = cube.draw(&mut storage, &pose);
        assert_eq!(stats.dropped, 0);
        (stats.polygons, count.gaps_and_doubles())
    };
    for roll in [0, 1, 1 << 28, 1 << 29, 0xABCD_EF01] {
        for above in [128, 129, 256, 257, 512, unit / 256 * 3] {
            assert_eq!(looking_on(above, roll), (1, (0, 0)), "{above} above");
        }
        // Nearer than the near plane: nothing of the face is left.
        assert_eq!(looking_on(127, roll), (0, (WIDTH * HEIGHT, 0)));
    }
}

#[test]
fn beyond_the_limits_all_is_dropped_and_counted() {
    let mut storage = Box::new(Storage::new());
    let cube = Solid::cuboid([1 << 16; 3]);
    for (distance, dropped) in [
        (-1, 6),
        (i32::MIN, 6),
        (0, 0),
        (1, 0),
        (Pose::MAX_DISTANCE - 1, 0),
        (Pose::MAX_DISTANCE, 0),
        (Pose::MAX_DISTANCE + 1, 6),
        (i32::MAX, 6),
    ] {
        let pose = Pose {
            distance,
            ..Pose::at_tick(0)
        };
        let (stats, count) = cube.draw(&mut storage, &pose);
        assert_eq!(stats.dropped, dropped, "distance {distance}");
        let (gaps, doubles) = count.gaps_and_doubles();
        // At the furthest the cube is some four pixels wide; from inside it shows no face.
        let empty = dropped > 0 || distance < 2;
        assert_eq!((gaps == WIDTH * HEIGHT, doubles), (empty, 0));
    }
}

/// Such a face is no legal one; it must do no harm.
#[test]
fn a_zigzag_that_clipping_gives_too_many_corners_is_dropped_and_counted() {
    let mut storage = Box::new(Storage::new());
    for (corners, dropped) in [(3, 0), (5, 0), (MAX_CORNERS, 1)] {
        let vertices: Vec<Vec3> = (0..corners as i32)
            .map(|i| {
                [
                    if i % 2 == 0 { -1 } else { 1 } * MAX_EXTENT,
                    i * 99,
                    1 << 12,
                ]
            })
            .collect();
        let face: Vec<u16> = (0..corners as u16).collect();
        let solid = Solid::new(&vertices, &[&face]);
        let straight = Pose {
            yaw: 0,
            pitch: 0,
            roll: 0,
            distance: 0,
        };
        let (stats, _) = solid.draw(&mut storage, &straight);
        assert_eq!(stats.dropped, dropped, "{corners} corners");
    }
}

#[test]
fn meshes_that_clipping_has_no_room_for_are_refused() {
    let ring = |corners: u16| {
        let vertices = vec![[0; 3]; usize::from(corners)];
        Solid::new(&vertices, &[&(0..corners).collect::<Vec<_>>()])
    };
    let far = |extent: i32| Solid::cuboid([extent, 1, 1]);
    let accepted = |solid: &Solid| {
        let solid = solid.clone();
        std::panic::catch_unwind(move || solid.on_stage(&mut Box::new(Storage::new()), |_| ()))
            .is_ok()
    };
    let corners = MAX_CORNERS as u16;
    for (solid, legal) in [
        (ring(2), false),
        (ring(3), true),
        (ring(corners - 1), true),
        (ring(corners), true),
        (ring(corners + 1), false),
        (far(MAX_EXTENT - 1), true),
        (far(MAX_EXTENT), true),
        (far(MAX_EXTENT + 1), false),
    ] {
        assert_eq!(accepted(&solid), legal, "{solid:?}");
    }
}

/// An octahedron, every edge of which may lie exactly on pixels' centres.
fn octahedron() -> Solid {
    let one = 1 << 16;
    let vertices = [
        [one, 0, 0],
        [-one, 0, 0],
        [0, one, 0],
        [0, -one, 0],
        [0, 0, one],
        [0, 0, -one],
    ];
    Solid::new(
        &vertices,
        &[
            &[5, 0, 2],
            &[0, 4, 2],
            &[4, 1, 2],
            &[1, 5, 2],
            &[0, 5, 3],
            &[4, 0, 3],
            &[1, 4, 3],
            &[5, 1, 3],
        ],
    )
}

/// What drawing solids from outside came to.
#[derive(Debug, Default)]
struct Outside {
    poses: u32,
    pixels: u64,
    /// Pixels written twice.
    doubles: u32,
}

/// Draws solids from outside and turned inside out, from a radius of a twentieth of a pixel on.
///
/// What their fronts cover their backs do, each pixel as often: so the fronts leave no gap. Nearly
/// always that is once. A facet at the silhouette may be turned over by snapping, though; it then
/// lies on its neighbour, 1/256 pixel wide, and where a pixel's centre lies in that fold both
/// cover it. No rule for single polygons can tell: culling by the real area would leave a gap.
fn closed_from_outside(poses: u32) -> Outside {
    let mut random = random();
    let [mut front_storage, mut back_storage] = [(); 2].map(|()| Box::new(Storage::new()));
    let mut outside = Outside::default();
    for solid in [Solid::ball(), Solid::cuboid([1 << 16; 3]), octahedron()] {
        for shift in [0, 3, 6] {
            let mut solid = solid.clone();
            for vertex in &mut solid.vertices {
                *vertex = vertex.map(|k| k >> shift);
            }
            let back = solid.clone().inside_out();
            solid.on_stage(&mut front_storage, |front| {
                back.on_stage(&mut back_storage, |back| {
                    for _ in 0..poses / 3 {
                        let bits = random.u32(17..23);
                        let distance = random.i32(1 << bits..=(2 << bits).min(Pose::MAX_DISTANCE));
                        let pose = pose(&mut random, distance);
                        let [mut fronts, mut backs] = [Count::new(), Count::new()];
                        front.draw(&pose, &mut *fronts);
                        back.draw(&pose, &mut *backs);
                        let same = fronts.times == backs.times;
                        assert!(same, "{pose:?}, shift {shift}, {solid:?}");
                        let times = |n: u8| fronts.times.iter().filter(move |&&times| times == n);
                        assert!(fronts.times.iter().all(|&times| times <= 2));
                        outside.poses += 1;
                        outside.pixels += (times(1).count() + times(2).count()) as u64;
                        outside.doubles += times(2).count() as u32;
                    }
                });
            });
        }
    }
    println!("{outside:?}");
    outside
}

#[test]
fn closed_solids_have_no_gap_from_outside_and_hardly_a_fold() {
    let outside = closed_from_outside(300);
    assert!(outside.pixels > 500_000);
    // One in some ten thousand poses has one.
    assert!(outside.doubles <= 3);
}

/// `cargo test --release -p scene --test clips -- --ignored --nocapture`
#[test]
#[ignore = "10^5 orientations of each of three solids: minutes, and only in a release build"]
fn closed_solids_have_no_gap_at_a_hundred_thousand_orientations() {
    let outside = closed_from_outside(100_000);
    assert!(outside.doubles * 10_000 <= outside.poses);
}
