//! Compares tiled textures with the same rectangle stored with all of its texels, for every mapper.

mod faces;

use texmap::{Face, Mapper, Texture};

use faces::*;

#[test]
fn a_tiled_texture_is_the_rectangle_that_it_lays_out() {
    let mut random = seeded::generator();
    for _ in 0..seeded::cases(6) {
        let tile = (1 << random.u32(0..=6), 1 << random.u32(0..=6));
        let size = (random.u16(1..=256), random.u16(1..=256));
        let texels = texels(tile.0, tile.1);
        let tiled = Texture::tiled(&texels, tile, size.0, size.1).unwrap();
        assert_eq!(
            (tiled.tile(), tiled.width(), tiled.height()),
            (Some(tile), size.0, size.1)
        );
        let laid_out: Vec<u8> = (0..size.1)
            .flat_map(|j| (0..size.0).map(move |i| (i % tile.0, j % tile.1)))
            .map(|(i, j)| texels[usize::from(j * tile.0 + i)])
            .collect();
        let whole = Texture::new(&laid_out, size.0, size.1).unwrap();
        for v in 0..size.1.into() {
            for u in 0..size.0.into() {
                assert_eq!(tiled.at(u << 16, v << 16), whole.at(u << 16, v << 16));
            }
        }
        let sides = random.usize(3..=5);
        let face = Face {
            polygon: &polygon(&mut random, sides, size),
            texture: 0,
            anchors: anchors(&mut random, size),
            focal_length: FOCAL_LENGTH,
        };
        for &(name, mapper, _) in Mapper::ALL {
            let of = [tiled, whole].map(|texture| jobs(mapper, &face, &texture));
            assert_eq!(of[0], of[1], "{name}: {tile:?} in {size:?}, {face:?}");
            check_pixels(mapper, &face, &tiled);
            check_drawing(mapper, &face, &tiled);
        }
    }
}
