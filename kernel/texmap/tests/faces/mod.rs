//! Faces to map, and checks that the renderer draws them as their jobs say.

// Each test uses only a part of this module.
#![allow(dead_code)]

use modex::{Counted, Destination, HEIGHT, ModeX, PAGE_BYTES, PlanarBuffer, Tally};
use texmap::plane::Anchor;
use texmap::scan;
use texmap::{Axis, Face, Job, JobList, Mapper, Order, Renderer, Stats, Texture, Vertex};
use vga::Vga;

pub const FOCAL_LENGTH: i32 = 258;
const BACKGROUND: [u8; HEIGHT] = [0; HEIGHT];

/// Returns the texels of a padded texture, all of other colours than the background.
pub fn texels(width: u16, height: u16) -> Vec<u8> {
    let len = Texture::padded_len(width, height);
    (0..len).map(|i| (i * 31 % 251) as u8 | 1).collect()
}

/// Returns a convex or irregular polygon anywhere near the screen, with coordinates inside the texture.
pub fn polygon(random: &mut fastrand::Rng, sides: usize, (w, h): (u16, u16)) -> Vec<Vertex> {
    let spread = [4, 40, 400][random.usize(..3)] * 256;
    let snap = [1, 128, 256][random.usize(..3)];
    let (x, y) = (random.i32(0..320 * 256), random.i32(0..240 * 256));
    (0..sides)
        .map(|_| Vertex {
            x: x + random.i32(-spread..=spread) / snap * snap,
            y: y + random.i32(-spread..=spread) / snap * snap,
            u: random.i32(0..=i32::from(w) << 16),
            v: random.i32(0..=i32::from(h) << 16),
        })
        .collect()
}

/// Returns any three points: in front of the eye, behind it, across it; sometimes degenerate.
pub fn anchors(random: &mut fastrand::Rng, (w, h): (u16, u16)) -> [Anchor; 3] {
    let most = 1 << random.u32(4..=24);
    let mut anchors = [(); 3].map(|()| Anchor {
        position: [(); 3].map(|()| random.i32(-most..=most)),
        u: random.i32(0..=i32::from(w) << 16),
        v: random.i32(0..=i32::from(h) << 16),
    });
    match random.u8(0..12) {
        // No change of depth down, to the right, or at all; then no plane.
        0 => anchors[1].position = anchors[0].position.map(|k| k / 2),
        1 => anchors.iter_mut().for_each(|a| a.position[1] = most),
        2 => anchors.iter_mut().for_each(|a| a.position[0] = -most),
        3 => anchors.iter_mut().for_each(|a| a.position[2] = most),
        4 => anchors.iter_mut().for_each(|a| a.position[2] = -most),
        5 => anchors = [anchors[0]; 3],
        _ => {}
    }
    anchors
}

pub fn jobs(mapper: Mapper, face: &Face<'_>, texture: &Texture<'_>) -> Vec<Job> {
    let mut jobs = Vec::new();
    mapper.jobs(face, texture, |job| jobs.push(job)).unwrap();
    jobs
}

/// Checks that every covered pixel is in exactly one job, that jobs have no other pixels, and that all texels
/// are inside the texture.
pub fn check_pixels(mapper: Mapper, face: &Face<'_>, texture: &Texture<'_>) -> usize {
    let mut inside = vec![0u8; 320 * 240];
    scan::spans_and_crossings(Axis::Down, face.polygon, |span| {
        for y in span.first..span.first + span.len {
            inside[usize::from(y) * 320 + usize::from(span.line)] += 1;
        }
    })
    .unwrap();
    let covered = inside.iter().map(|&times| usize::from(times)).sum();
    let (last_u, last_v) = texture.last();
    for job in jobs(mapper, face, texture) {
        assert!(job.len > 0);
        job.pixels(texture, |(x, y), (u, v)| {
            let texel = (0..=last_u).contains(&u) && (0..=last_v).contains(&v);
            assert!(
                texel,
                "{mapper}: ({x}, {y}) reads {u} {v}: {job:?}, {face:?}"
            );
            let at = &mut inside[usize::from(y) * 320 + usize::from(x)];
            assert_eq!(*at, 1, "{mapper}: ({x}, {y}) of {job:?}, {face:?}");
            *at = 0;
        });
    }
    assert!(inside.iter().all(|&left| left == 0), "{mapper}: {face:?}");
    covered
}

/// Draws a face in two orders, in RAM and on the emulated VGA, and checks that each page equals the pixels of
/// the jobs. Returns the counts of each order.
pub fn check_drawing(
    mapper: Mapper,
    face: &Face<'_>,
    texture: &Texture<'_>,
) -> [(Stats, Tally); 2] {
    let mut expected = PlanarBuffer::new();
    for job in jobs(mapper, face, texture) {
        job.pixels(texture, |(x, y), (u, v)| {
            expected.column(x, y, 1, |pixel| pixel.fill(|| texture.at(u, v)));
        });
    }
    let textures = [*texture];
    // A short list, which is often full.
    let mut list = JobList::<50>::new();
    let face = Face {
        texture: 0,
        ..*face
    };
    [Order::Polygons, Order::Planes].map(|order| {
        let mut page = PlanarBuffer::new();
        let mut renderer = Renderer::new(&mut list, &textures, &mut page, mapper, order);
        renderer.face(&face);
        let stats = renderer.finish();
        assert!(page == expected, "{mapper} by {order} in RAM: {face:?}");

        let mut card = ModeX::set(Counted::new(Vga::new()), &[[0; 3]; 256]).unwrap();
        let mut canvas = card.begin(&BACKGROUND);
        let mut renderer = Renderer::new(&mut list, &textures, &mut canvas, mapper, order);
        renderer.face(&face);
        renderer.finish();
        let tally = card.bus().counts().draw;
        let vga = card.bus().inner();
        for (plane, bytes) in expected.planes.iter().enumerate() {
            for (i, &byte) in bytes.iter().enumerate() {
                let stored = vga.peek(plane, (PAGE_BYTES + i) as u16);
                assert_eq!(
                    stored, byte,
                    "{mapper} by {order}: {i} of {plane}: {face:?}"
                );
            }
        }
        let faults = vga.take_faults();
        assert!(faults.is_empty(), "{mapper} by {order}: {faults:?}");
        (stats, tally)
    })
}
