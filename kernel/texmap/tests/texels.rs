//! The texels that jobs read: [`Job::texels`] has the index of each, and it lies in the texture.
//!
//! [`Job::texels`]: texmap::Job::texels

mod faces;

use modex::PlanarBuffer;
use texmap::{Dropped, Face, Mapper, Texture, Vertex};

use faces::*;

/// Checks that every index lies in the texture, and that the pixel drawn has that texel. Returns the number
/// of pixels.
fn check(mapper: Mapper, face: &Face<'_>, texture: &Texture<'_>) -> usize {
    let pitch = usize::from(texture.pitch());
    let whole = (texture.width(), texture.height());
    let (columns, rows) = texture.tile().unwrap_or(whole);
    let (columns, rows) = (columns.min(whole.0), rows.min(whole.1));
    let mut pixels = 0;
    let mut page = PlanarBuffer::new();
    for job in jobs(mapper, face, texture) {
        job.draw(mapper.style(), texture, &mut page);
        job.texels(texture, |(x, y), index| {
            let (column, row) = (index % pitch, index / pitch);
            assert!(
                column < columns.into() && row < rows.into(),
                "{mapper}: ({x}, {y}) reads texel {index}: {job:?}, {face:?}"
            );
            assert_eq!(
                page.pixel(x.into(), y.into()),
                texture.texels()[index],
                "{mapper}: ({x}, {y}), texel {index}: {job:?}, {face:?}"
            );
            pixels += 1;
        });
    }
    pixels
}

/// Plain textures, padded textures whose padding must not be read, and tiles.
#[test]
fn every_texel_that_a_job_reads_is_in_the_texture() {
    let mut random = seeded::generator();
    let all: Vec<u8> = (0..1 << 16).map(|_| random.u8(..)).collect();
    let mut pixels = 0;
    for case in 0..seeded::cases(60) {
        let size = (random.u16(1..=256), random.u16(1..=256));
        let texture = match case % 3 {
            0 => Texture::new(
                &all[..usize::from(size.0) * usize::from(size.1)],
                size.0,
                size.1,
            ),
            1 => Texture::padded(&all[..Texture::padded_len(size.0, size.1)], size.0, size.1),
            _ => {
                let tile = (1 << random.u32(0..=6), 1 << random.u32(0..=6));
                let len = usize::from(tile.0) * usize::from(tile.1);
                Texture::tiled(&all[..len], tile, size.0, size.1)
            }
        };
        let texture = texture.unwrap();
        let sides = random.usize(3..=8);
        let face = Face {
            polygon: &polygon(&mut random, sides, size),
            texture: 0,
            anchors: anchors(&mut random, size),
            focal_length: FOCAL_LENGTH,
        };
        for &(_, mapper, _) in Mapper::ALL {
            pixels += check(mapper, &face, &texture);
        }
    }
    println!("{pixels} pixels");
    assert!(!seeded::is_whole() || pixels > 1_000_000);
}

/// A polygon with texture coordinates outside the texture: the mappers that interpolate them drop it, and the
/// others draw it with texels of the texture.
#[test]
fn coordinates_outside_the_texture_drop_a_polygon_or_are_clamped() {
    let mut random = seeded::generator();
    let texels = texels(3, 100);
    let texture = Texture::padded(&texels, 3, 100).unwrap();
    for _ in 0..seeded::cases(100) {
        let outside = match random.u8(..4) {
            0 => (-1, 0),
            1 => (0, -1),
            2 => ((3 << 16) + 1, 0),
            _ => (0, (100 << 16) + 1),
        };
        let (right, down) = (random.i32(10..320) * 256, random.i32(10..240) * 256);
        let mut polygon = [(0, 0), (right, 0), (right, down), (0, down)].map(|(x, y)| Vertex {
            x,
            y,
            u: random.i32(0..=3 << 16),
            v: random.i32(0..=100 << 16),
        });
        let corner = random.usize(..4);
        (polygon[corner].u, polygon[corner].v) = outside;
        let face = Face {
            polygon: &polygon,
            texture: 0,
            // Legal in a larger texture.
            anchors: anchors(&mut random, (256, 256)),
            focal_length: FOCAL_LENGTH,
        };
        for &(name, mapper, _) in Mapper::ALL {
            match mapper {
                Mapper::Affine(_) | Mapper::HalfStep | Mapper::Rows(_) => {
                    let mut some = false;
                    let result = mapper.jobs(&face, &texture, |_| some = true);
                    assert_eq!((result, some), (Err(Dropped::OutOfRange), false), "{name}");
                }
                _ => assert_eq!(
                    check(mapper, &face, &texture),
                    (right / 256 * (down / 256)) as usize,
                    "{name}"
                ),
            }
        }
    }
}
