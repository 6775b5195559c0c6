//! The workloads that mappers are measured on: scenes at several poses, and random polygons.

use render::{RenderMemory, SceneRenderer};
use scene::catalogue::{CATALOGUE, Entry, MAX_TEXELS};
use scene::{Corner, FOCAL_LENGTH, Mesh, MeshFace, Pose, Scene, Vec3};
use texmap::plane::Anchor;
use texmap::{Face, Texture, Vertex};

/// The name of the scene of random polygons.
pub const RANDOM: &str = "random";
/// The number of polygons of the random scene.
const POLYGONS: usize = 200;

/// The ticks of the measured frames: a twelfth of a turn and one tick apart.
pub const TICKS: [u32; 4] = [0, 61, 122, 183];

/// A face that owns its polygon.
#[derive(Clone, Debug)]
pub struct OwnedFace {
    polygon: Vec<Vertex>,
    texture: u16,
    anchors: [Anchor; 3],
    focal_length: i32,
}

impl OwnedFace {
    fn new(face: &Face<'_>) -> Self {
        Self {
            polygon: face.polygon.to_vec(),
            texture: face.texture,
            anchors: face.anchors,
            focal_length: face.focal_length,
        }
    }

    /// Returns a face with a polygon and three anchors of its texture plane.
    pub fn from_parts(polygon: Vec<Vertex>, anchors: [Anchor; 3]) -> Self {
        Self {
            polygon,
            texture: 0,
            anchors,
            focal_length: FOCAL_LENGTH,
        }
    }

    /// Returns the face in the form that the mappers accept.
    pub fn face(&self) -> Face<'_> {
        Face {
            polygon: &self.polygon,
            texture: self.texture,
            anchors: self.anchors,
            focal_length: self.focal_length,
        }
    }
}

/// The input of a measurement: a scene at several poses, projected, with its textures lit.
#[derive(Debug)]
pub struct Workload<'a> {
    /// The scene's name.
    pub name: &'static str,
    /// A line about the scene.
    pub about: String,
    /// The faces of each frame.
    pub frames: Vec<Vec<OwnedFace>>,
    /// The textures of the faces, lit.
    pub textures: Vec<Texture<'a>>,
    /// The DAC's colours, with 8 bits a component.
    pub palette: [[u8; 3]; 256],
    /// The background colour of each scan line.
    pub background: [u8; modex::HEIGHT],
}

impl<'a> Workload<'a> {
    fn new(
        name: &'static str,
        about: String,
        renderer: &'a mut SceneRenderer<'_>,
        poses: &[Pose],
    ) -> Self {
        let mut frames = Vec::new();
        for pose in poses {
            let mut faces = Vec::new();
            renderer
                .at(pose)
                .faces(|_, face| faces.extend(face.as_ref().map(OwnedFace::new)));
            frames.push(faces);
        }
        let renderer: &'a SceneRenderer<'_> = renderer;
        let numbers = frames.iter().flatten().map(|face| face.texture);
        let most = numbers.max().unwrap_or(0);
        Self {
            name,
            about,
            frames,
            textures: (0..=most).map(|number| renderer.surface(number)).collect(),
            palette: renderer.palette().map(|colour| colour.map(vga::widen)),
            background: *renderer.background(),
        }
    }

    /// Returns a texture by the number that a face or a job has.
    pub fn texture(&self, number: u16) -> &Texture<'a> {
        &self.textures[usize::from(number)]
    }
}

/// Scenes that are not measured: the features that they show (hidden surfaces, tiles, mipmaps) cost the same
/// under every mapper.
const NOT_MEASURED: [&str; 3] = ["knot", "corridor", "moire"];

/// Returns the names of all workloads.
pub fn names() -> impl Iterator<Item = &'static str> {
    let names = CATALOGUE.iter().map(|entry| entry.name);
    names
        .filter(|name| !NOT_MEASURED.contains(name))
        .chain([RANDOM])
}

/// Makes the workload with this name, and passes it to `measure`. `seed` is the seed of the random scene.
///
/// # Panics
/// If no scene has the name.
pub fn with<T>(name: &str, seed: u64, measure: impl FnOnce(&Workload<'_>) -> T) -> T {
    if name == RANDOM {
        return with_random(seed, measure);
    }
    let entry = Entry::parse(name).expect("the scene was looked up before");
    with_entry(entry, measure)
}

/// Makes a workload of a scene at [`TICKS`], and passes it to `measure`.
pub fn with_entry<T>(entry: &Entry<'_>, measure: impl FnOnce(&Workload<'_>) -> T) -> T {
    with_poses(entry, &TICKS.map(|tick| entry.pose(tick)), measure)
}

/// Makes a workload of a scene at some poses, and passes it to `measure`.
pub fn with_poses<T>(
    entry: &Entry<'_>,
    poses: &[Pose],
    measure: impl FnOnce(&Workload<'_>) -> T,
) -> T {
    let mut texels = Box::new([0; MAX_TEXELS]);
    let mut memory = in_place::boxed!(RenderMemory);
    let textures = entry.paint(&mut texels);
    let mut renderer = SceneRenderer::new(&mut memory, entry.scene(&textures));
    let about = entry.about.to_string();
    measure(&Workload::new(entry.name, about, &mut renderer, poses))
}

/// Makes the random workload, with the colours and the texture of the scene `tilted`, and passes it to
/// `measure`.
fn with_random<T>(seed: u64, measure: impl FnOnce(&Workload<'_>) -> T) -> T {
    let mut texels = Box::new([0; MAX_TEXELS]);
    let mut memory = in_place::boxed!(RenderMemory);
    let entry = Entry::parse("tilted").expect("the scene is in the catalogue");
    let textures = entry.paint(&mut texels);
    let (vertices, corners, faces) = random_mesh(seed);
    let mesh = Mesh {
        vertices: &vertices,
        corners: &corners,
        faces: &faces,
        convex: true,
    };
    let scene = Scene {
        name: RANDOM,
        mesh,
        ..entry.scene(&textures)
    };
    let pose = Pose {
        yaw: 0,
        pitch: 0,
        roll: 0,
        distance: 0,
    };
    let about = format!("{POLYGONS} parallelograms at random, seed {seed}");
    let mut renderer = SceneRenderer::new(&mut memory, scene);
    measure(&Workload::new(RANDOM, about, &mut renderer, &[pose]))
}

/// Returns parallelograms that face the eye, from near to far, each with the whole texture.
fn random_mesh(seed: u64) -> (Vec<Vec3>, Vec<Corner>, Vec<MeshFace>) {
    let mut random = fastrand::Rng::with_seed(seed);
    let (mut vertices, mut corners, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    while faces.len() < POLYGONS {
        // From half a unit to 32 units; each doubling of the distance is equally likely.
        let distance = (random.f64() * 6.0 - 1.0).exp2();
        let mut around = |size: f64| (random.f64() * 2.0 - 1.0) * size * distance;
        let middle = [around(0.6), around(0.45), distance];
        let [m, n] = [0; 2].map(|_| [around(0.5), around(0.5), around(0.9)]);
        let corner = |a: f64, b: f64| {
            [0, 1, 2].map(|k| ((middle[k] + a * m[k] + b * n[k]) * 65_536.0).round() as i32)
        };
        let places = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
        let quad = places.map(|(a, b)| corner(a, b));
        if quad.iter().any(|place| place[2] < 2048) {
            continue;
        }
        let cross = [0, 1, 2].map(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            m[i] * n[j] - m[j] * n[i]
        });
        let facing: f64 = (0..3).map(|k| cross[k] * middle[k]).sum();
        let length = cross.iter().map(|c| c * c).sum::<f64>().sqrt();
        // A parallelogram that faces away is turned over below. A parallelogram that is seen almost edge-on
        // is left out.
        if facing.abs() < 0.02 * length * distance {
            continue;
        }
        let order = if facing > 0.0 {
            [0, 1, 2, 3]
        } else {
            [0, 3, 2, 1]
        };
        let first = corners.len() as u16;
        let base = vertices.len() as u16;
        vertices.extend(quad);
        let side = (textures_side() as i32) << 16;
        let uv = [(0, 0), (side, 0), (side, side), (0, side)];
        corners.extend(order.map(|i| Corner {
            vertex: base + i as u16,
            u: uv[i].0,
            v: uv[i].1,
        }));
        let sign = -facing.signum() / length;
        faces.push(MeshFace {
            first,
            corners: 4,
            texture: 0,
            normal: cross.map(|c| (c * sign * 16_384.0) as i32),
        });
    }
    (vertices, corners, faces)
}

/// Returns the side of the catalogue's largest textures.
const fn textures_side() -> usize {
    MAX_TEXELS.isqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_workload_has_faces_and_is_the_same_each_time() {
        for name in names() {
            let faces = |workload: &Workload<'_>| {
                assert_eq!(workload.name, name);
                let faces = workload.frames.iter().flatten();
                faces.map(|face| face.polygon.clone()).collect::<Vec<_>>()
            };
            let once = with(name, 7, faces);
            assert!(!once.is_empty(), "{name}");
            assert_eq!(once, with(name, 7, faces), "{name}");
        }
    }

    #[test]
    fn random_polygons_face_the_viewer_and_depend_on_the_seed() {
        let polygons = |seed| {
            with(RANDOM, seed, |workload| {
                let faces = &workload.frames[0];
                // A few polygons are off the screen, but no polygon is lost because it faces away.
                assert!(faces.len() > POLYGONS * 9 / 10, "{}", faces.len());
                faces
                    .iter()
                    .map(|face| face.polygon.clone())
                    .collect::<Vec<_>>()
            })
        };
        assert_ne!(polygons(1), polygons(2));
    }
}
