//! A slanted face that fills the screen, so that nearly all work is in the inner loops.

use modex::{HEIGHT, WIDTH};
use texmap::plane::{Anchor, Plane, PlaneStepper, coordinate};
use texmap::{Axis, Face, SUBPIXELS, Texture, Vertex};

/// Width and height of the texture.
const SIDE: u16 = Texture::MAX_SIDE;
/// Texels in the texture.
pub const TEXELS: usize = SIDE as usize * SIDE as usize;

/// The texture's middle, in 1/64 unit: 4 units in front of the eye. The texture's axes are turned by 30
/// degrees about the line of sight, and both lead away from the viewer. A pixel is about half a texel wide,
/// depths on the screen are within a ratio of 1.3, and the screen's corners are inside the texture.
const MIDDLE: [i32; 3] = [0, 0, 256];
/// The vector from the left border of the texture to the right.
const ACROSS: [i32; 3] = [440, 254, 77];
/// The vector from the top of the texture to the bottom.
const DOWN: [i32; 3] = [-254, 440, 38];
/// 1/64 unit, 16.16.
const UNIT: i32 = 1 << 10;

const FOCAL_LENGTH: i32 = scene::FOCAL_LENGTH;

/// The screen's polygon, and the plane of its texture.
#[derive(Clone, Copy, Debug)]
pub struct Screen {
    polygon: [Vertex; 4],
    anchors: [Anchor; 3],
}

impl Screen {
    /// Returns the face that fills the screen. Its corners have the coordinates that the texture's plane has
    /// there, so affine mappers and perspective mappers traverse the same part of the texture.
    pub fn new() -> Self {
        let anchors = [(0, 0), (SIDE, 0), (0, SIDE)].map(|(u, v)| {
            let part = |k: usize, side: u16, axis: [i32; 3]| match side {
                0 => -axis[k] * UNIT / 2,
                _ => axis[k] * UNIT / 2,
            };
            Anchor {
                position: [0, 1, 2]
                    .map(|k| MIDDLE[k] * UNIT + part(k, u, ACROSS) + part(k, v, DOWN)),
                u: i32::from(u) << 16,
                v: i32::from(v) << 16,
            }
        });
        let plane = Plane::new(&anchors, FOCAL_LENGTH);
        let (right, bottom) = (WIDTH as u16, HEIGHT as u16);
        let corners = [(0, 0), (right, 0), (right, bottom), (0, bottom)];
        let polygon = corners.map(|(x, y)| {
            // Use the centre of the corner's pixel, half a pixel inwards.
            let pixel = (x.min(right - 1), y.min(bottom - 1));
            let [a, b, c] = PlaneStepper::new(&plane, Axis::Down, pixel.0, pixel.1).at;
            Vertex {
                x: i32::from(x) * SUBPIXELS,
                y: i32::from(y) * SUBPIXELS,
                u: coordinate(a, c, SIDE),
                v: coordinate(b, c, SIDE),
            }
        });
        Self { polygon, anchors }
    }

    /// Returns the face, with texture 0.
    pub fn face(&self) -> Face<'_> {
        Face {
            polygon: &self.polygon,
            texture: 0,
            anchors: self.anchors,
            focal_length: FOCAL_LENGTH,
        }
    }

    /// Returns the face reduced to the `width` x `height` pixels at the top left, for spans of these lengths.
    /// For affine mappers this squeezes the texture, which does not change what a span costs.
    pub fn part(&self, width: u16, height: u16) -> Self {
        let mut part = *self;
        for vertex in &mut part.polygon {
            vertex.x = vertex.x.min(i32::from(width) * SUBPIXELS);
            vertex.y = vertex.y.min(i32::from(height) * SUBPIXELS);
        }
        part
    }
}

/// Paints the texture, in which no two neighbours are equal.
pub fn paint(texels: &mut [u8; TEXELS]) -> Texture<'_> {
    for (j, row) in (0..=u8::MAX).zip(texels.chunks_exact_mut(SIDE.into())) {
        for (i, texel) in (0..=u8::MAX).zip(row) {
            *texel = i.wrapping_mul(3) ^ j.wrapping_mul(5);
        }
    }
    Texture::padded(texels, SIDE, SIDE).expect("there are 256 x 256 texels")
}
