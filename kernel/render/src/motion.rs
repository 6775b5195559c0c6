//! How the texture moves on the screen from one frame to the next.
//!
//! # The sweet spot
//!
//! Chapter 57 describes a range of speeds, neither too slow nor too fast, at which the eye sees frames as
//! motion, and leaves finding the range to experience. Here both ends are measured.
//!
//! Too slow: a texture's edge is drawn in whole pixels, so it does not glide but moves in steps of a pixel.
//! The eye sees images that come at fewer than some twelve a second one by one ([`STEPS_A_SECOND`]). It sees
//! such steps one by one too, and since every edge steps at its own time, the edges seem to crawl.
//!
//! Too fast: the eye connects an edge with the nearest similar edge in the previous frame. If a pattern moves
//! by half a period, it lies as far ahead of its previous place as behind it; if it moves further, it seems
//! to run backward.
//!
//! So the median motion of all visible pixels, in pixels from frame to frame, has to lie between the two
//! ends. The motion scales with the speed of turning, and the ends scale with the frame rate. The motion's
//! place in the range therefore says how much faster or slower the solid may turn.
//!
//! # The motion
//!
//! The motion of a pixel follows from its texture coordinates before and after, and from their slopes, which
//! convert texels to pixels. Both come from the faces' planes, as the exact mapper's coordinates do. Since a
//! median is wanted, a grid of pixels is enough. Only visible faces count.

use modex::{HEIGHT, WIDTH};
use scene::{FOCAL_LENGTH, Pose};
use texmap::Axis;
use texmap::plane::{Plane, coordinate};
use texmap::scan::spans;

use crate::PosedScene;
use crate::quality::PoseChange;

/// Images a second that the eye still sees one by one, not as motion. (P. Read and M.-P. Meyer, Restoration
/// of Motion Picture Film, 2000: 10 to 12.)
pub const STEPS_A_SECOND: u32 = 12;

/// Pixels from one sample to the next, in x and y.
const GRID: u16 = 8;
/// Most samples.
const SAMPLES: usize = WIDTH / GRID as usize * (HEIGHT / GRID as usize);

/// The motion of the visible texture in one tick: medians over the sampled pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureMotion {
    /// On the screen, in 2^-16 pixel.
    pub pixels: u32,
    /// In the texture, as a fraction of half its period, in 2^-16.
    pub part: u32,
}

impl TextureMotion {
    /// Returns the least and most pixels from frame to frame, 16.16, that the eye sees as motion. A frame
    /// lasts `ticks` ticks, 16.16. Returns `None` if nothing moves in the texture.
    pub fn sweet_spot(&self, ticks: u32, ticks_a_second: u32) -> Option<(u32, u32)> {
        let least = u64::from(STEPS_A_SECOND) * u64::from(ticks) / u64::from(ticks_a_second);
        let most = (u64::from(self.pixels) << 16).checked_div(u64::from(self.part))?;
        Some((least as u32, most.min(u64::from(u32::MAX)) as u32))
    }
}

impl PosedScene<'_> {
    /// Returns how the visible texture moves from this pose to `next`, or `None` if too little of it is
    /// visible.
    pub fn motion(&self, next: &Pose) -> Option<TextureMotion> {
        let surfaces = self.faces.surfaces;
        let half_period = surfaces.half_period()?;
        let change = PoseChange::new(&self.pose, next);
        let (mut pixels, mut parts) = ([0; SAMPLES], [0; SAMPLES]);
        let mut count = 0;
        self.faces.each(|number, face| {
            let Some(face) = face else { return };
            let texture = surfaces.texture(face.texture);
            let size = (texture.width(), texture.height());
            let before = face.plane();
            let after = Plane::new(&change.anchors(&face.anchors), FOCAL_LENGTH);
            // A face outside the legal range is not visible.
            let _ = spans(Axis::Down, face.polygon, |span| {
                if span.line % GRID != GRID / 2 {
                    return;
                }
                for y in (span.first..span.first + span.len).filter(|y| y % GRID == GRID / 2) {
                    let x = span.line;
                    let seen = self
                        .visible
                        .is_none_or(|visible| visible.at(x, y) == Some(number));
                    if let Some((pixel, texel)) = sample(&before, &after, size, x, y)
                        && seen
                        && count < SAMPLES
                    {
                        pixels[count] = pixel;
                        parts[count] = ((u64::from(texel) << 16) / u64::from(half_period))
                            .min(u64::from(u32::MAX)) as u32;
                        count += 1;
                    }
                }
            });
        });
        let median = |values: &mut [u32]| *values.select_nth_unstable(values.len() / 2).1;
        (count > 0).then(|| TextureMotion {
            pixels: median(&mut pixels[..count]),
            part: median(&mut parts[..count]),
        })
    }
}

/// Returns how far the texture moves at a pixel: on the screen, in 16.16 pixels, and in the texture, in 16.16
/// texels. The result is `None` near a border of the texture, and where its slopes give no direction.
fn sample(before: &Plane, after: &Plane, size: (u16, u16), x: u16, y: u16) -> Option<(u32, u32)> {
    let at = |plane: &Plane, x: u16, y: u16| {
        let c = plane.c.at(x, y);
        let inside = |n: i64, size: u16| {
            let found = coordinate(n, c, size);
            // Coordinates beyond the texture are clamped to its borders, so a border value may be wrong.
            (found > 0 && found < (i32::from(size) << 16) - 1).then_some(i64::from(found))
        };
        Some((
            inside(plane.a.at(x, y), size.0)?,
            inside(plane.b.at(x, y), size.1)?,
        ))
    };
    let (u, v) = at(before, x, y)?;
    let (right, down) = (at(before, x + 1, y)?, at(before, x, y + 1)?);
    let (moved_u, moved_v) = at(after, x, y)?;
    let (du, dv) = (moved_u - u, moved_v - v);
    let (ux, vx, uy, vy) = (right.0 - u, right.1 - v, down.0 - u, down.1 - v);
    // Each factor is below 2^24, so each result is below 2^49.
    let turn = ux * vy - uy * vx;
    let shift = |n: i64| {
        let shift = (i128::from(n) << 16).checked_div(i128::from(turn))?;
        Some(shift.clamp(-(1 << 40), 1 << 40))
    };
    let (dx, dy) = (shift(du * vy - dv * uy)?, shift(dv * ux - du * vx)?);
    let length = |a: i128, b: i128| (a * a + b * b).isqrt().min(i128::from(u32::MAX)) as u32;
    Some((length(dx, dy), length(du.into(), dv.into())))
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::{RenderMemory, RenderOptions, SceneRenderer};
    use scene::catalogue::{CATALOGUE, Entry, MAX_TEXELS};
    use std::boxed::Box;
    use std::vec::Vec;
    use texmap::Mapper;

    /// Calls `check` with each scene's entry and a stage of it.
    fn with_renderers(mut check: impl FnMut(&Entry<'_>, &mut SceneRenderer<'_>)) {
        for entry in CATALOGUE {
            let mut texels = Box::new([0; MAX_TEXELS]);
            let textures = entry.paint(&mut texels);
            let mut memory = in_place::boxed!(RenderMemory);
            check(
                entry,
                &mut SceneRenderer::new(&mut memory, entry.scene(&textures)),
            );
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
        let mut faces = std::collections::HashMap::new();
        let mut at = std::collections::HashMap::new();
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
                let own =
                    [0, 1, 2].map(|k| (0..3).map(|row| from[row][k] * place[row]).sum::<f64>());
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
        with_renderers(|entry, renderer| {
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
            std::println!(
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
        with_renderers(|entry, renderer| {
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
                        let mut page = Box::new(modex::PlanarBuffer::new());
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
}
