//! Which face is nearest at each pixel, from the definition; and solids that hide parts of themselves.
//!
//! Of the front faces that cover a pixel, the nearest is visible; of faces at equal distance, the first. The
//! distance of a face is that of its plane, through its three anchors, along the ray through the pixel's
//! centre. It is infinite if that plane is seen edge-on or from behind.

use std::cmp::Ordering;
use std::f64::consts::TAU;
use std::ops::Range;

use fastrand::Rng;
use modex::{HEIGHT, WIDTH};
use render::{RenderMemory, RenderOptions, SceneRenderer};
use scene::{FOCAL_LENGTH, Pose, Vec3};
use texmap::{Face, Point};

use crate::coverage::{Area, Pixels};
use crate::solid::{PixelCounter, Solid};
use crate::texel::{cross, dot};

/// The inverse depth (1/z) of a plane at a pixel, except for a factor that all planes share: a quotient whose
/// divisor is above zero.
#[derive(Clone, Copy, Debug)]
struct InverseDepth {
    n: i128,
    d: i128,
}

impl InverseDepth {
    /// Returns the inverse depth of a plane through three points within 2^24: n is below 2^63 and d below
    /// 2^78.
    fn new(anchors: &[Vec3; 3], x: i32, y: i32) -> Self {
        let [a, b, c] = anchors.map(|point| point.map(i128::from));
        let away = |p: [i128; 3]| [0, 1, 2].map(|k| p[k] - a[k]);
        let normal = cross(away(b), away(c));
        let d = dot(normal, a);
        if d <= 0 {
            return Self { n: 0, d: 1 };
        }
        let ray = [
            2 * x - (WIDTH as i32 - 1),
            2 * y - (HEIGHT as i32 - 1),
            2 * FOCAL_LENGTH,
        ];
        let n = dot(normal, ray.map(i128::from));
        Self { n, d }
    }

    /// Compares n d' with n' d, exactly: in two parts, the low 40 bits and the rest.
    fn cmp(&self, other: &Self) -> Ordering {
        let product = |n: i128, d: i128| {
            let low = n * (d & ((1 << 40) - 1));
            (n * (d >> 40) + (low >> 40), low & ((1 << 40) - 1))
        };
        product(self.n, other.d).cmp(&product(other.n, self.d))
    }

    /// Returns whether the two values differ by less than 2^-40 of the larger: the renderer rounds the
    /// normals of very large faces.
    fn is_close_to(&self, other: &Self) -> bool {
        let (a, b) = (
            self.n as f64 / self.d as f64,
            other.n as f64 / other.d as f64,
        );
        (a - b).abs() <= a.abs().max(b.abs()) / (1u64 << 40) as f64
    }
}

/// Counts of the comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DepthCounts {
    /// Pixels that a face covers.
    pub pixels: u64,
    /// Pixels that more than one face covers.
    pub contested: u64,
    /// Contested pixels where the renderer chose another face that is as near, to within 2^-40.
    pub ties: u64,
    /// Places in a column where one face ends and another begins.
    pub borders: u64,
}

/// Compares the visible face at each pixel, and how often each pixel is written when the frame is drawn with
/// `options`.
///
/// # Errors
/// A description of the first difference.
pub fn check(
    memory: &mut RenderMemory,
    solid: &Solid,
    pose: &Pose,
    options: RenderOptions,
) -> Result<DepthCounts, String> {
    let mut count = PixelCounter::default();
    solid.with_renderer(memory, |renderer| {
        let nearest = sorted(renderer, pose);
        let posed = renderer.at(pose);
        let visible = posed.visible().expect("the solid is not convex");
        let mut compared = DepthCounts::default();
        let mut found = Vec::new();
        for i in 0..WIDTH * HEIGHT {
            let (x, y) = (i % WIDTH, i / WIDTH);
            found.push(visible.at(x as u16, y as u16));
        }
        for (i, (seen, &found)) in nearest.iter().zip(&found).enumerate() {
            let (x, y) = (i % WIDTH, i / WIDTH);
            let expected = seen.first().map(|first| first.0);
            compared.pixels += u64::from(expected.is_some());
            compared.contested += u64::from(seen.len() > 1);
            if expected == found {
                continue;
            }
            let near = |&(number, inverse_depth): &(u16, InverseDepth)| {
                Some(number) == found && inverse_depth.is_close_to(&seen[0].1)
            };
            if !seen.iter().any(near) {
                return Err(format!(
                    "({x}, {y}) shows face {found:?}, but the nearest face is {expected:?}"
                ));
            }
            compared.ties += 1;
        }
        let below =
            |i: usize| found[i].is_some() && found.get(i + WIDTH).is_some_and(|b| *b != found[i]);
        compared.borders = (0..found.len()).filter(|&i| below(i)).count() as u64;
        let stats = count.redraw(renderer, pose, options);
        if u64::from(stats.pixels) != compared.pixels {
            return Err(format!(
                "{} pixels were written, but faces cover {}",
                stats.pixels, compared.pixels
            ));
        }
        for (i, &found) in found.iter().enumerate() {
            let (x, y, times) = (i % WIDTH, i / WIDTH, count.times(i));
            if times != u8::from(found.is_some()) {
                return Err(format!(
                    "({x}, {y}) is written {times} times, not {}",
                    u8::from(found.is_some())
                ));
            }
        }
        Ok(compared)
    })
}

/// Returns the numbers of the front faces that cover each pixel, the nearest first.
pub fn nearest(renderer: &mut SceneRenderer<'_>, pose: &Pose) -> Vec<Vec<u16>> {
    let numbers = |faces: Vec<(u16, InverseDepth)>| faces.into_iter().map(|face| face.0).collect();
    sorted(renderer, pose).into_iter().map(numbers).collect()
}

/// Returns the faces that cover each pixel, the nearest first.
fn sorted(renderer: &mut SceneRenderer<'_>, pose: &Pose) -> Vec<Vec<(u16, InverseDepth)>> {
    let mut at = vec![Vec::new(); WIDTH * HEIGHT];
    let mut covered = Pixels::default();
    renderer.at(pose).faces(|number, face| {
        let Some(Face {
            polygon, anchors, ..
        }) = face
        else {
            return;
        };
        let polygon: Vec<Point> = polygon.iter().map(|&vertex| vertex.into()).collect();
        let anchors = anchors.map(|anchor| anchor.position);
        let area = Area::around(&polygon);
        covered.cover(&polygon, &area);
        for y in area.y {
            for x in area.x.clone().filter(|&x| covered.contains(x, y)) {
                let inverse_depth = InverseDepth::new(&anchors, x, y);
                at[y as usize * WIDTH + x as usize].push((number, inverse_depth));
            }
        }
    });
    for faces in &mut at {
        // The sort is stable: of equal faces the first stays first.
        faces.sort_by(|(_, a), (_, b)| b.cmp(a));
    }
    at
}

/// Returns a tube of triangles around a closed curve: `around` rings with `sides` corners each. `ring`
/// returns a ring's centre and two directions across, all in units.
fn tube(around: u16, sides: u16, ring: impl Fn(f64) -> [[f64; 3]; 3]) -> Solid {
    let mut vertices = Vec::new();
    for i in 0..around {
        let [middle, out, up] = ring(f64::from(i) / f64::from(around) * TAU);
        for j in 0..sides {
            let (sin, cos) = (f64::from(j) / f64::from(sides) * TAU).sin_cos();
            let place = |k: usize| middle[k] + cos * out[k] + sin * up[k];
            vertices.push([0, 1, 2].map(|k| (place(k) * 65536.0).round() as i32));
        }
    }
    let mut faces = Vec::new();
    for i in 0..around {
        for j in 0..sides {
            let at = |i: u16, j: u16| i % around * sides + j % sides;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            faces.push([a, b, c]);
            faces.push([a, c, d]);
        }
    }
    let faces: Vec<&[u16]> = faces.iter().map(|face| &face[..]).collect();
    Solid::new(&vertices, &faces).concave()
}

/// Returns a torus of a radius and a thickness that lies in x and z, or stands.
fn torus(radius: f64, thickness: f64, middle: [f64; 3], stands: bool) -> Solid {
    tube(20, 9, |angle| {
        let (sin, cos) = angle.sin_cos();
        let turned = |[x, y, z]: [f64; 3]| if stands { [x, -z, y] } else { [x, y, z] };
        let out = [cos, 0.0, sin];
        let at = turned(out.map(|k| k * radius));
        [
            [0, 1, 2].map(|k| at[k] + middle[k]),
            turned(out.map(|k| k * thickness)),
            turned([0.0, thickness, 0.0]),
        ]
    })
}

/// Returns a tube along a trefoil.
fn knot() -> Solid {
    tube(48, 5, |angle| {
        let at = |t: f64| {
            let reach = 0.6 + 0.25 * (1.5 * t).cos();
            [reach * t.cos(), 0.3 * (1.5 * t).sin(), reach * t.sin()]
        };
        // Twice around until it closes.
        let (here, next) = (at(2.0 * angle), at(2.0 * angle + 0.01));
        let unit = |v: [f64; 3]| {
            let length = v.iter().map(|k| k * k).sum::<f64>().sqrt();
            v.map(|k| k / length)
        };
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [0, 1, 2].map(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
        };
        let along = unit([0, 1, 2].map(|k| next[k] - here[k]));
        let out = unit(cross(along, [0.0, 1.0, 0.0]));
        [
            here,
            out.map(|k| k * 0.12),
            cross(out, along).map(|k| k * 0.12),
        ]
    })
}

/// Independent triangles anywhere: most of them cut others.
fn soup(random: &mut Rng, triangles: u16, extent: i32) -> Solid {
    let place = |random: &mut Rng| [(); 3].map(|()| random.i32(-extent..=extent));
    let vertices: Vec<Vec3> = (0..3 * triangles).map(|_| place(random)).collect();
    let faces: Vec<[u16; 3]> = (0..triangles)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect();
    let faces: Vec<&[u16]> = faces.iter().map(|face| &face[..]).collect();
    Solid::new(&vertices, &faces).concave()
}

/// Returns ten solids that hide parts of themselves in different ways, and the range of distances from which
/// they are seen.
pub fn models(random: &mut Rng) -> [(&'static str, Solid, Range<i32>); 10] {
    const UNIT: i32 = 1 << 16;
    let afar = 2 * UNIT..6 * UNIT;
    let spikes: Vec<i32> = (0..338).map(|_| random.i32(UNIT / 4..UNIT)).collect();
    let boxes = |half: [Vec3; 3]| {
        let [a, b, c] = half.map(Solid::cuboid);
        a.and(&b).and(&c)
    };
    let long = 5 * UNIT / 4;
    let cross = [
        [long, 20_000, 25_000],
        [21_000, long, 26_000],
        [22_000, 27_000, long],
    ];
    // Every face twice in the same place.
    let twice = Solid::cuboid([UNIT; 3]).and(&Solid::cuboid([UNIT; 3]));
    let shell = Solid::cuboid([UNIT, UNIT / 2, UNIT]).inside_out();
    [
        ("a ring", torus(0.8, 0.35, [0.0; 3], false), afar.clone()),
        ("a knot", knot(), afar.clone()),
        (
            "a crag",
            Solid::ball().stretched(&spikes).concave(),
            afar.clone(),
        ),
        (
            "two rings, linked",
            torus(0.6, 0.2, [-0.3, 0.0, 0.0], false).and(&torus(0.6, 0.2, [0.3, 0.0, 0.0], true)),
            afar.clone(),
        ),
        ("three beams through each other", boxes(cross), afar.clone()),
        ("every face twice", twice, afar.clone()),
        ("a ball in a shell", shell.and(&Solid::ball()), afar.clone()),
        ("triangles anywhere", soup(random, 150, UNIT), 0..3 * UNIT),
        ("slivers", soup(random, 300, 2_000), 4_000..30_000),
        (
            "triangles of 100 units",
            soup(random, 60, scene::MAX_EXTENT),
            0..128 * UNIT,
        ),
    ]
}
