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
