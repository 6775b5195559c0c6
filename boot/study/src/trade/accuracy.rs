//! The error of a mapper's coordinates, and the difference of its frame from the exact mapper's.
//!
//! The exact coordinate at a pixel is the quotient of the plane's integers at the pixel's centre, clamped
//! into the texture. The error is the larger of |u' - u| and |v' - v|, in texels, where (u, v) is the exact
//! coordinate and (u', v') is the mapper's. Mappers have 16.16 coordinates, so even the exact mapper's error
//! is between 0 and 2^-16.

use modex::{HEIGHT, PlanarBuffer, WIDTH};
use texmap::plane::{Plane, texel};
use texmap::{JobList, Mapper, Order, Renderer, Texture};

use super::stats::{ErrorHistogram, psnr};
use super::workload::{OwnedFace, Workload};

/// The jobs of a whole frame.
pub type FrameJobs = JobList<{ render::MAX_JOBS }>;

/// A mapper's accuracy on a scene.
#[derive(Clone, Debug, Default)]
pub struct Accuracy {
    /// The errors of all pixels, in texels.
    pub errors: ErrorHistogram,
    /// The number of pixels whose texel is not the exact mapper's.
    pub other_texels: u64,
    /// The peak signal-to-noise ratio of a whole frame against the exact mapper's, in decibels: the worst of
    /// all frames.
    pub psnr: f64,
}

impl Accuracy {
    /// Returns the share of pixels whose texel is not the exact mapper's, 0 to 1.
    pub fn other_share(&self) -> f64 {
        self.other_texels as f64 / self.errors.count().max(1) as f64
    }

    /// Adds the accuracy on another scene.
    pub fn extend(&mut self, other: &Self) {
        self.errors.extend(&other.errors);
        self.other_texels += other.other_texels;
        self.psnr = self.psnr.min(other.psnr);
    }
}

/// The exact coordinate at a pixel.
#[derive(Clone, Copy, Debug)]
struct ExactCoordinate {
    /// The coordinates, in texels, from 0 to the texture's sides.
    at: (f64, f64),
    /// The exact mapper's texel.
    texel: (u16, u16),
}

impl ExactCoordinate {
    fn new(plane: &Plane, texture: &Texture<'_>, x: u16, y: u16) -> Self {
        let [a, b, c] = [plane.a, plane.b, plane.c].map(|form| form.at(x, y));
        let coordinate = |n: i64, size: u16| {
            let size_c = i64::from(size).checked_mul(c);
            match n {
                ..0 => 0.0,
                // As in the mappers: points beyond the texture, on the horizon and behind it get the border.
                _ if size_c.is_none_or(|most| n >= most) => f64::from(size),
                _ => n as f64 / c as f64,
            }
        };
        let (width, height) = (texture.width(), texture.height());
        Self {
            at: (coordinate(a, width), coordinate(b, height)),
            texel: (texel(a, c, width), texel(b, c, height)),
        }
    }
}

/// Calls `sink` with each pixel of a face, its error in texels, and whether its texel differs from the exact
/// mapper's.
pub fn errors(
    mapper: Mapper,
    face: &OwnedFace,
    texture: &Texture<'_>,
    mut sink: impl FnMut((u16, u16), f64, bool),
) {
    let face = face.face();
    let plane = face.plane();
    let dropped = mapper.jobs(&face, texture, |job| {
        job.pixels(texture, |(x, y), (u, v)| {
            let exact = ExactCoordinate::new(&plane, texture, x, y);
            let off = |at: i32, exact: f64| (f64::from(at) / 65_536.0 - exact).abs();
            let error = off(u, exact.at.0).max(off(v, exact.at.1));
            let other = ((u >> 16) as u16, (v >> 16) as u16) != exact.texel;
            sink((x, y), error, other);
        });
    });
    dropped.expect("a scene's faces are legal");
}

/// Draws a frame of a workload with a mapper, and returns its pixels.
pub fn frame(
    workload: &Workload<'_>,
    number: usize,
    mapper: Mapper,
    jobs: &mut FrameJobs,
) -> Vec<u8> {
    let mut page = Box::new(PlanarBuffer::new());
    page.clear(&workload.background);
    let order = Order::default();
    let mut renderer = Renderer::new(jobs, &workload.textures, &mut *page, mapper, order);
    for face in &workload.frames[number] {
        renderer.face(&face.face());
    }
    renderer.finish();
    let pixels = (0..WIDTH * HEIGHT).map(|i| page.pixel(i % WIDTH, i / WIDTH));
    pixels.collect()
}

/// Measures a mapper on all frames of a workload.
pub fn measure(workload: &Workload<'_>, mapper: Mapper, jobs: &mut FrameJobs) -> Accuracy {
    let mut accuracy = Accuracy {
        psnr: f64::INFINITY,
        ..Accuracy::default()
    };
    for (number, faces) in workload.frames.iter().enumerate() {
        for face in faces {
            let texture = workload.texture(face.face().texture);
            errors(mapper, face, texture, |_, error, other| {
                accuracy.errors.add(error);
                accuracy.other_texels += u64::from(other);
            });
        }
        let [drawn, exact] = [mapper, Mapper::Exact].map(|mapper| {
            let pixels = frame(workload, number, mapper, jobs);
            let colours = pixels.iter().map(|&i| workload.palette[usize::from(i)]);
            colours.collect::<Vec<_>>()
        });
        accuracy.psnr = accuracy.psnr.min(psnr(&drawn, &exact));
    }
    accuracy
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trade::workload::{RANDOM, with};

    #[test]
    fn the_exact_mapper_has_exact_texels() {
        let mut jobs = Box::new(FrameJobs::new());
        for name in ["ball", "grazing-4096", RANDOM] {
            with(name, 3, |workload| {
                let exact = measure(workload, Mapper::Exact, &mut jobs);
                assert!(exact.errors.count() > 10_000, "{name}");
                assert!(exact.errors.largest() < 1.0 / 65_535.0, "{name}");
                assert_eq!(exact.other_texels, 0, "{name}");
                assert_eq!(exact.psnr, f64::INFINITY, "{name}");
            });
        }
    }

    /// Checks the bound for affine columns. If the depths at a column's ends have the ratio r, and u differs
    /// by du between the ends, the largest error in u is |du| (sqrt r - 1) / (sqrt r + 1). On a level floor,
    /// every column has the same error.
    #[test]
    fn the_error_of_an_affine_column_is_within_the_formulas_bound() {
        let affine = Mapper::parse("affine").unwrap();
        with("tilted", 0, |workload| {
            for faces in &workload.frames {
                let face = &faces[0];
                let texture = workload.texture(face.face().texture);
                let mut worst: f64 = 0.0;
                errors(affine, face, texture, |_, error, _| {
                    worst = worst.max(error)
                });
                // The square's depths are at most 2.3 -+ 1 units, so their ratio is below 2.6. A column
                // crosses at most the diagonal's 256 texels in either coordinate.
                let root = 2.6f64.sqrt();
                let bound = 256.0 * (root - 1.0) / (root + 1.0);
                assert!(worst > 4.0 && worst < bound, "{worst} of {bound}");
            }
        });
    }

    #[test]
    fn an_affine_mapper_has_a_small_error_without_perspective() {
        let affine = Mapper::parse("affine").unwrap();
        let mut jobs = Box::new(FrameJobs::new());
        with("facing", 0, |workload| {
            let accuracy = measure(workload, affine, &mut jobs);
            // Vertices are rounded to 1/256 pixel, but the exact coordinate is not.
            assert!(accuracy.errors.largest() < 0.02, "{accuracy:?}");
            assert!(accuracy.psnr > 25.0);
        });
    }
}
