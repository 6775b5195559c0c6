//! Solids that hide parts of themselves, against an oracle of exact depths.

use oracle::depth::{check, models};
use oracle::solid::pose;
use render::{RenderMemory, RenderOptions};
use texmap::{Mapper, Order};

/// Checks that each pixel shows the nearest face and is written once, in `poses` poses with each of some
/// mappers. A limit on the number of cases also limits the number of solids; the solids are then chosen at
/// random.
fn hidden(poses: usize, mappers: &[(Mapper, Order)]) {
    let poses = seeded::cases(poses);
    let mut random = seeded::generator();
    let mut memory = in_place::boxed!(RenderMemory);
    let mut models = models(&mut random);
    random.shuffle(&mut models);
    let solids = seeded::cases(models.len());
    for (name, solid, distances) in models.into_iter().take(solids) {
        let (mut pixels, mut contested, mut ties, mut borders) = (0, 0, 0, 0);
        for &(mapper, order) in mappers.iter().cycle().take(poses * mappers.len()) {
            let distance = random.i32(distances.clone());
            let pose = pose(&mut random, distance);
            let options = RenderOptions {
                mapper,
                order,
                next: None,
            };
            let compared = check(&mut memory, &solid, &pose, options)
                .unwrap_or_else(|wrong| panic!("{name} by {mapper}, {order}, {pose:?}: {wrong}"));
            pixels += compared.pixels;
            contested += compared.contested;
            ties += compared.ties;
            borders += compared.borders;
        }
        println!(
            "{name}: {pixels} pixels, {contested} of them covered more than once, {borders} borders \
             down the columns, {ties} ties within 2^-40"
        );
        // With so many poses some part of each solid is behind another.
        assert!(contested > 0 || poses < 6, "{name} hides nothing");
        let large = solid.extent() > 1 << 22;
        assert!(
            ties == 0 || large,
            "{name}: nothing of it is cut to 45 bits"
        );
    }
}

#[test]
fn the_nearest_face_is_seen_and_written_once() {
    hidden(6, &[(Mapper::default(), Order::Polygons)]);
}

/// Spans in rows, and spans in any direction, are cut as well.
#[test]
fn it_is_so_by_every_mapper_in_every_order() {
    let all = Mapper::ALL.iter().enumerate();
    let mappers: Vec<_> = all
        .map(|(i, &(_, mapper, _))| (mapper, Order::ALL[i % 2].1))
        .collect();
    let mut random = seeded::generator();
    for part in mappers.chunks(8) {
        hidden(1, &[part[random.usize(..part.len())]]);
    }
}

/// All solids and mappers; runs for a few minutes.
#[test]
#[ignore = "deep"]
fn it_is_so_in_many_poses() {
    let mappers: Vec<_> = Mapper::ALL
        .iter()
        .flat_map(|&(_, mapper, _)| [Order::Polygons, Order::Planes].map(|order| (mapper, order)))
        .collect();
    hidden(1, &mappers);
    hidden(1000, &[(Mapper::default(), Order::Polygons)]);
}
