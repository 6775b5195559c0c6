//! Every triangle of a small world: the ordered triples of points on a lattice of 16 x 16.

use texmap::Point;

/// Number of triangles.
pub const TRIANGLES: u32 = 1 << 24;

/// Lattices that meet many pixel centres (128 beyond a multiple of 256) and pixel edges. The points are half
/// a pixel apart (8 x 8 pixels in all) or a quarter (4 x 4).
pub const STEPS: [i32; 2] = [128, 64];

/// Returns triangle `number` of the world with this step; it lies within the screen.
pub fn triangle(step: i32, number: u32) -> [Point; 3] {
    [16, 8, 0].map(|shift| {
        let place = (number >> shift & 0xFF) as i32;
        Point {
            x: 60 * 256 + place % 16 * step,
            y: 100 * 256 + place / 16 * step,
        }
    })
}
