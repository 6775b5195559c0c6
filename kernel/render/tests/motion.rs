//! The motion of a texture, its sweet spot, and reduced quality.

mod common;

use std::collections::HashMap;

use common::with_renderer;
use modex::PlanarBuffer;
use render::motion::TextureMotion;
use render::{RenderOptions, SceneRenderer};
use scene::catalogue::{CATALOGUE, Entry};
use scene::{FOCAL_LENGTH, Pose};
use texmap::scan::spans;
use texmap::{Axis, Mapper};

/// Calls `check` with each scene's entry and its renderer.
fn with_each_renderer(mut check: impl FnMut(&Entry<'_>, &mut SceneRenderer<'_>)) {
    for entry in CATALOGUE {
        with_renderer(entry.name, &mut check);
    }
}

/// Returns the median motion, found another way: a ray from each pixel to the visible face, in floating
/// point, moves with the solid to its next place on the screen. The grid is finer.
fn median_by_rays(renderer: &mut SceneRenderer<'_>, pose: &Pose, next: &Pose) -> f64 {
    let rows = |pose: &Pose| {
        let orientation = pose.orientation();
        let columns = [0, 1, 2].map(|k| {
            let mut unit = [0; 3];
            unit[k] = 1 << 29;
            orientation
                .turn(unit)
                .map(|n| f64::from(n) / f64::from(1 << 29))
        });
        [0, 1, 2].map(|row| [0, 1, 2].map(|column| columns[column][row]))
    };
    let (from, to) = (rows(pose), rows(next));
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let unit = |n: i32| f64::from(n) / 65_536.0;
    let focal = f64::from(FOCAL_LENGTH);
    let mut faces = HashMap::new();
    let mut at = HashMap::new();
    let posed = renderer.at(pose);
    posed.faces(|number, face| {
        let Some(face) = face else { return };
        let [a, b, c] = face.anchors.map(|anchor| anchor.position.map(unit));
        let [u, v] = [b, c].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
        let normal = [1, 2, 0].map(|i| u[i] * v[(i + 1) % 3] - u[(i + 1) % 3] * v[i]);
        faces.insert(number, (normal, dot(normal, a)));
        let _ = spans(Axis::Down, face.polygon, |span| {
            for y in span.first..span.first + span.len {
                if span.line % 3 == 1 && y % 3 == 1 {
                    at.entry((span.line, y)).or_insert(number);
                }
            }
        });
    });
    if let Some(visible) = posed.visible() {
        at.retain(|&(x, y), number| {
            visible.at(x, y).is_some_and(|seen| {
                *number = seen;
                true
            })
        });
    }
    let mut ways: Vec<f64> = at
        .iter()
        .map(|(&(x, y), number)| {
            let (normal, height) = faces[number];
            let ray = [f64::from(x) - 159.5, f64::from(y) - 119.5, focal];
            let t = height / dot(normal, ray);
            let [px, py, pz] = ray.map(|k| k * t);
            let place = [px, py, pz - unit(pose.distance)];
            let own = [0, 1, 2].map(|k| (0..3).map(|row| from[row][k] * place[row]).sum::<f64>());
            let [qx, qy, qz] = to.map(|row| dot(row, own));
            let qz = qz + unit(next.distance);
            let (dx, dy) = (focal * qx / qz - ray[0], focal * qy / qz - ray[1]);
            dx.hypot(dy)
        })
        .collect();
    ways.sort_by(f64::total_cmp);
    ways[ways.len() / 2]
}

/// The default turn of each scene lies in the sweet spot, except in the scenes that sway. These stand
/// still at both ends of their swing and move slowly between: their floors and wall are there to be
/// looked at, not to turn.
#[test]
fn the_default_turn_lies_in_the_sweet_spot() {
    with_each_renderer(|entry, renderer| {
        let sways = ["grazing-16", "grazing-4096", "wall"].contains(&entry.name);
        let (mut pixels, mut ends) = (Vec::new(), Vec::new());
        for tick in (0..720).step_by(48) {
            let (pose, next) = (entry.pose(tick), entry.pose(tick + 1));
            let motion = renderer.at(&pose).motion(&next).unwrap();
            let found = f64::from(motion.pixels) / 65_536.0;
            let rays = median_by_rays(renderer, &pose, &next);
            let near = (found - rays).abs() < 0.03 + rays / 20.0;
            assert!(near, "{} at {tick}: {found}, {rays} by rays", entry.name);
            let Some((least, most)) = motion.sweet_spot(1 << 16, 60) else {
                continue;
            };
            assert!(
                sways || (least..most).contains(&motion.pixels),
                "{} at {tick}: {motion:?} is outside {least}..{most}; change the pose, or add the scene to `sways`",
                entry.name
            );
            pixels.push(found);
            ends.push(f64::from(most) / 65_536.0);
        }
        for values in [&mut pixels, &mut ends] {
            values.sort_by(f64::total_cmp);
        }
        let (middle, most) = (pixels[pixels.len() / 2], ends[ends.len() / 2]);
        println!(
            "{}: {middle:.2} pixels a frame ({:.2} to {:.2}), the sweet spot is 0.20 to {most:.1}",
            entry.name,
            pixels[0],
            pixels[pixels.len() - 1]
        );
    });
}

/// If a frame lasts more ticks, steps come more slowly, and the least motion grows.
#[test]
fn the_sweet_spot_scales_with_the_rate_of_frames() {
    let motion = TextureMotion {
        pixels: 1 << 16,
        part: 1 << 14,
    };
    assert_eq!(motion.sweet_spot(1 << 16, 60), Some((13_107, 4 << 16)));
    assert_eq!(motion.sweet_spot(5 << 16, 60), Some((1 << 16, 4 << 16)));
    assert_eq!(
        TextureMotion { part: 0, ..motion }.sweet_spot(1 << 16, 60),
        None
    );
}

/// A face that turns in its own plane keeps its quality with every mapper; a face that tumbles does not.
#[test]
fn a_face_that_moves_in_its_own_plane_keeps_its_quality() {
    with_each_renderer(|entry, renderer| {
        let mut reduced = 0;
        for tick in (0..720).step_by(48) {
            for name in ["exact", "within-1/4", "shifts", "row-steps", "linear-8"] {
                let mapper = Mapper::parse(name).unwrap();
                let pose = entry.pose(tick);
                let mut draw = |next| {
                    let options = RenderOptions {
                        mapper,
                        next,
                        ..RenderOptions::default()
                    };
                    let mut page = Box::new(PlanarBuffer::new());
                    let drawn = renderer.draw(&pose, options, &mut *page);
                    (drawn.stats.pixels, drawn.reduced)
                };
                let (pixels, none) = draw(None);
                assert_eq!((none, draw(Some(pose)).1), (0, 0));
                let (same, some) = draw(Some(entry.pose(tick + 1)));
                assert_eq!(same, pixels, "{} {name} at {tick}", entry.name);
                assert!(
                    some == 0 || ["exact", "within-1/4"].contains(&name),
                    "{name}"
                );
                reduced += some;
            }
        }
        let in_plane = ["facing", "tilted"].contains(&entry.name);
        assert_eq!(
            reduced == 0,
            in_plane,
            "{}: {reduced} faces in reduced quality; `in_plane` lists the scenes that move in their plane",
            entry.name
        );
    });
}
