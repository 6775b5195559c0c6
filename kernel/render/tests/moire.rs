//! Measures the moire pattern of the corridor: how much it shimmers, with mipmaps and without.
//!
//! A pixel should show the mean of the area that it covers. Here that is the mean of 8 x 8 samples in the
//! pixel, in the full-size textures, by the planes' quotients. Where texels are left out, a frame's error
//! changes from one frame to the next, as different texels are left out each time; the eye sees that change
//! as crawling. The mean square of the change is the energy. An error that stays, such as the hue of a mean
//! that the palette lacks, does not count.

mod common;

use common::with_renderer;
use modex::{HEIGHT, PlanarBuffer, WIDTH};
use oracle::depth::nearest;
use render::{RenderOptions, SceneRenderer};
use scene::Pose;
use scene::catalogue::Entry;
use texmap::plane::Form;
use texmap::{Mapper, Plane};

/// Samples across a pixel, and as many down.
const PLACES: i64 = 8;

/// Returns the mean of the samples of each pixel that covers more than two texels: red, green and blue, 0 to
/// 63. At other pixels the exact mapper leaves out hardly any texel.
fn means(renderer: &mut SceneRenderer<'_>, pose: &Pose) -> Vec<Option<[f64; 3]>> {
    let seen = nearest(renderer, pose);
    let mut faces = Vec::new();
    renderer.at(pose).faces(|number, face| {
        let face = face.unwrap();
        faces.push((number, face.plane(), face.texture));
    });
    let (palette, mut means) = (*renderer.palette(), vec![None; WIDTH * HEIGHT]);
    for (number, Plane { a, b, c }, surface) in faces {
        let texture = renderer.surface(surface);
        let (last_u, last_v) = texture.last();
        for (i, mean) in means.iter_mut().enumerate() {
            if seen[i].first() != Some(&number) {
                continue;
            }
            let (x, y) = ((i % WIDTH) as u16, (i / WIDTH) as u16);
            let at = |form: &Form, i: i64, j: i64| {
                let offset = form.right * (2 * i + 1 - PLACES) + form.down * (2 * j + 1 - PLACES);
                (form.at(x, y) + offset / (2 * PLACES)) as f64
            };
            let wide = |form: &Form| {
                let at = |i, j| at(form, i, j) / at(&c, i, j);
                let change = at(PLACES, 0) - at(0, 0);
                change.abs().max((at(0, PLACES) - at(0, 0)).abs()) > 2.0
            };
            if !wide(&a) && !wide(&b) {
                continue;
            }
            let mut sum = [0.0; 3];
            for (i, j) in (0..PLACES).flat_map(|j| (0..PLACES).map(move |i| (i, j))) {
                let c = at(&c, i, j);
                let coordinate = |form: &Form, last: i32| {
                    let texels = at(form, i, j) / c * 65536.0;
                    texels.clamp(0.0, f64::from(last)) as i32
                };
                let texel = texture.at(coordinate(&a, last_u), coordinate(&b, last_v));
                for (sum, part) in sum.iter_mut().zip(palette[usize::from(texel)]) {
                    *sum += f64::from(part);
                }
            }
            *mean = Some(sum.map(|sum| sum / (PLACES * PLACES) as f64));
        }
    }
    means
}

/// Returns the colour error of each covered pixel.
fn errors(
    renderer: &mut SceneRenderer<'_>,
    pose: &Pose,
    means: &[Option<[f64; 3]>],
) -> Vec<Option<[f64; 3]>> {
    let mut page = PlanarBuffer::new();
    let options = RenderOptions {
        mapper: Mapper::Exact,
        ..RenderOptions::default()
    };
    renderer.draw(pose, options, &mut page);
    let error = |(i, mean): (usize, &Option<[f64; 3]>)| {
        let colour = renderer.palette()[usize::from(page.pixel(i % WIDTH, i / WIDTH))];
        mean.map(|mean| [0, 1, 2].map(|k| f64::from(colour[k]) - mean[k]))
    };
    means.iter().enumerate().map(error).collect()
}

#[test]
fn mipmaps_remove_a_third_of_the_shimmer() {
    let pairs = [0, 130, 300, 555].map(|tick| [tick, tick + 1]);
    let pose = |tick: u32| Entry::parse("corridor").unwrap().pose(tick);
    let truth = with_renderer("moire", |_, renderer| {
        pairs.map(|pair| pair.map(|tick| means(renderer, &pose(tick))))
    });
    let energies = |name| {
        with_renderer(name, |_, renderer| {
            let mut energies = Vec::new();
            for (pair, means) in pairs.iter().zip(&truth) {
                let [a, b] = [0, 1].map(|i| errors(renderer, &pose(pair[i]), &means[i]));
                let both = a.iter().zip(&b).filter_map(|(a, b)| Some(((*a)?, (*b)?)));
                let squares: Vec<f64> = both
                    .map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>() / 3.0)
                    .collect();
                energies.push(squares.iter().sum::<f64>() / squares.len() as f64);
            }
            energies
        })
    };
    let (before, after) = (energies("moire"), energies("corridor"));
    for ((pair, before), after) in pairs.iter().zip(&before).zip(&after) {
        println!(
            "frames {} and {}: {before:.2} without mipmaps, {after:.2} with them: {:.1} times",
            pair[0],
            pair[1],
            before / after
        );
        assert!(after * 3.0 < before * 2.0, "{after} of {before}");
    }
}
