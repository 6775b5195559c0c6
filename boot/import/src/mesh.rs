//! From an OBJ's polygons to a mesh of flat convex faces.
//!
//! # Uncut and cut polygons
//!
//! A face of the renderer is convex and flat, and has one texture plane. A polygon that meets all three
//! conditions stays whole, up to [`MAX_CORNERS`] corners. Any other polygon is cut into triangles by ear
//! clipping, and triangles always meet the conditions. A polygon is flat if it bends by at most `FLATNESS`,
//! and it has one texture plane if no corner is more than `TEXEL_FIT` texels off that plane: smaller errors
//! are not visible. All pieces of a polygon have the polygon's normal, so that the light shows no cuts.

use anyhow::ensure;
use earcut::Earcut;
use earcut::utils3d::project3d_to_2d;
use model::MAX_ALL_CORNERS;
use scene::{Corner, MAX_CORNERS, MAX_FACES, MeshFace, Pose, Vec3};

use crate::layout::Layout;
use crate::obj::{BadLine, SIMPLIFY};
use crate::polygon::{FaceCounts, GRID, PolygonCorner, Polygons};
use crate::vector::{cross, dot, minus};

/// The largest difference in height of a face's corners over its plane, in units: a fifteenth of a pixel at
/// the default distance.
const FLATNESS: f64 = 1.0 / 2048.0;
/// The largest distance of a corner's texture coordinates from the face's texture plane, in texels.
const TEXEL_FIT: f64 = 1.0 / 16.0;
/// The smallest part of a face's area that the triangle of the texture plane's three corners may have.
const LEAST_ANCHORED: f64 = 1.0 / 16.0;
/// A mesh that owns its data.
#[derive(Clone, Debug, Default)]
pub struct ImportedMesh {
    /// The vertices, as in [`scene::Mesh`].
    pub vertices: Vec<Vec3>,
    /// The corners, as in [`scene::Mesh`].
    pub corners: Vec<Corner>,
    /// The faces, as in [`scene::Mesh`], but with `first` left at zero.
    pub faces: Vec<MeshFace>,
    /// Counts of the file's faces that were not imported unchanged.
    pub counts: FaceCounts,
}

/// The direction in which a mesh's faces point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facing {
    /// Some faces face the viewer.
    Viewer,
    /// All faces face the mesh's centre: the mesh is inside out.
    Inward,
    /// No face faces the viewer in the first frame.
    Away,
}

impl ImportedMesh {
    /// Makes a mesh from polygons, with corners placed in the texture that `layout` cuts.
    ///
    /// # Errors
    /// If there are more faces or corners than a model file may have, or no polygon can be cut into
    /// triangles.
    pub fn new(polygons: Polygons, layout: &Layout) -> anyhow::Result<Self> {
        let Polygons {
            vertices,
            polygons,
            counts,
        } = polygons;
        let mut mesh = Self {
            vertices,
            counts,
            ..Self::default()
        };
        let mut ears = EarCutter::default();
        // The number of faces, if each cut yields all its triangles.
        let mut triangles = 0;
        for polygon in &polygons {
            let places = layout.texels(polygon);
            let corners = polygon
                .ring
                .iter()
                .zip(places)
                .map(|(place, [u, v])| Corner {
                    vertex: place.vertex as u16,
                    u,
                    v,
                });
            let corners: Vec<_> = corners.collect();
            let normal = polygon.normal.map(|k| (k * 16_384.0).round() as i32);
            let mut add = |piece: &mut dyn Iterator<Item = usize>| {
                let before = mesh.corners.len();
                mesh.corners.extend(piece.map(|i| corners[i]));
                mesh.faces.push(MeshFace {
                    first: 0,
                    corners: (mesh.corners.len() - before) as u16,
                    texture: 0,
                    normal,
                });
            };
            let n = corners.len();
            let uncut = first_corner_of_uncut(&polygon.ring, polygon.normal, &corners);
            triangles += uncut.map_or(n - 2, |_| 1);
            // Checked before the cut, because to cut a face that visits the same points again and again
            // needs seconds.
            if triangles > MAX_FACES {
                let why = format!(
                    "with this face cut into triangles the model has more than {MAX_FACES} faces \
                     (the file has {}); {SIMPLIFY}",
                    polygons.len() + counts.degenerate,
                );
                let line = polygon.line;
                return Err(BadLine { line, why }.into());
            }
            match uncut {
                Some(first) => add(&mut (0..n).map(|i| (first + i) % n)),
                None => {
                    let triangles = ears.cut(&polygon.ring);
                    mesh.counts.cut += 1;
                    triangles
                        .iter()
                        .for_each(|triangle| add(&mut triangle.iter().copied()));
                }
            }
        }
        ensure!(
            mesh.corners.len() <= MAX_ALL_CORNERS,
            "the faces have {} corners, but at most {MAX_ALL_CORNERS} are allowed; {SIMPLIFY}",
            mesh.corners.len()
        );
        ensure!(
            !mesh.faces.is_empty(),
            "no face can be cut into triangles; {SIMPLIFY}"
        );
        Ok(mesh)
    }

    /// Returns the direction in which the faces point, to detect a file with the opposite winding rule.
    pub fn facing(&self) -> Facing {
        let pose = Pose::at_tick(0);
        let turn = pose.orientation();
        let (mut inside, mut away) = (true, true);
        let mut corners = &self.corners[..];
        for face in &self.faces {
            let (own, rest) = corners.split_at(face.corners.into());
            corners = rest;
            // Any point of the face's plane will do. The face may be bent, so this is the mean of its
            // corners.
            let vertex = |corner: &Corner| self.vertices[usize::from(corner.vertex)];
            let sum = own.iter().map(vertex).fold([0.0; 3], |sum, at| {
                [0, 1, 2].map(|k| sum[k] + f64::from(at[k]))
            });
            let middle = sum.map(|k| k / f64::from(face.corners));
            inside &= dot(middle, face.normal.map(f64::from)) < 0.0;
            let seen = turn.turn(middle.map(|k| k.round() as i32)).map(f64::from);
            let from_eye = [seen[0], seen[1], seen[2] + f64::from(pose.distance)];
            away &= dot(from_eye, turn.turn(face.normal).map(f64::from)) >= 0.0;
        }
        match (inside, away) {
            (true, _) => Facing::Inward,
            (_, true) => Facing::Away,
            _ => Facing::Viewer,
        }
    }
}

/// Returns the first corner of a polygon that stays whole, or `None` if the polygon must be cut.
fn first_corner_of_uncut(
    ring: &[PolygonCorner],
    normal: [f64; 3],
    corners: &[Corner],
) -> Option<usize> {
    let n = ring.len();
    if n == 3 {
        return Some(0);
    }
    if n > MAX_CORNERS {
        return None;
    }
    // A corner's signed distance from an edge, as an area on the plane. In a convex polygon, no corner is
    // outside any edge.
    let area = |a: &PolygonCorner, b: &PolygonCorner, c: &PolygonCorner| {
        dot(cross(minus(b.at, a.at), minus(c.at, a.at)), normal)
    };
    let convex = (0..n).all(|i| {
        let (a, b) = (&ring[i], &ring[(i + 1) % n]);
        ring.iter().all(|c| area(a, b, c) <= 0.0)
    });
    let area_of_face: f64 = -(1..n - 1)
        .map(|i| area(&ring[0], &ring[i], &ring[i + 1]))
        .sum::<f64>();
    let height = |place: &PolygonCorner| dot(minus(place.at, ring[0].at), normal);
    let (low, high) = ring.iter().map(height).fold((0.0, 0.0), |(low, high), h| {
        (f64::min(low, h), f64::max(high, h))
    });
    if !convex || high - low > FLATNESS * GRID {
        return None;
    }
    // The renderer puts the texture plane through these three corners, counted from the first. They must not
    // be on a line.
    let anchors = |first: usize| [0, n / 3, 2 * n / 3].map(|i| (first + i) % n);
    let anchored = |first: usize| {
        let [a, b, c] = anchors(first).map(|i| &ring[i]);
        -area(a, b, c)
    };
    let first = (0..n).max_by(|&a, &b| anchored(a).total_cmp(&anchored(b)))?;
    if anchored(first) < LEAST_ANCHORED * area_of_face {
        return None;
    }
    let three = anchors(first);
    let [a, b, c] = three.map(|i| &ring[i]);
    let fits = ring.iter().zip(corners).all(|(place, corner)| {
        // The weights of the three corners at this place.
        let weights = [area(b, c, place), area(c, a, place), area(a, b, place)];
        let total: f64 = weights.iter().sum();
        let off = |value: fn(&Corner) -> i32| {
            let planar: f64 = (0..3)
                .map(|k| f64::from(value(&corners[three[k]])) * weights[k] / total)
                .sum();
            (planar - f64::from(value(corner))).abs()
        };
        off(|corner| corner.u).max(off(|corner| corner.v)) <= TEXEL_FIT * GRID
    });
    fits.then_some(first)
}

/// Cuts polygons into triangles.
#[derive(Default)]
struct EarCutter {
    earcut: Earcut<f64>,
    flat: Vec<[f64; 2]>,
    cut: Vec<usize>,
}

impl EarCutter {
    /// Returns the triangles of a polygon, each with its corners in the polygon's order.
    fn cut(&mut self, ring: &[PolygonCorner]) -> Vec<[usize; 3]> {
        let points: Vec<_> = ring.iter().map(|place| place.at).collect();
        self.cut.clear();
        if project3d_to_2d(&points, points.len(), &mut self.flat) {
            let no_holes: &[usize] = &[];
            self.earcut
                .earcut(self.flat.iter().copied(), no_holes, &mut self.cut);
        }
        let (triangles, _) = self.cut.as_chunks::<3>();
        let in_order = |triangle: &[usize; 3]| {
            let mut triangle = *triangle;
            triangle.sort_unstable();
            triangle
        };
        triangles.iter().map(in_order).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polygon::RADIUS;
    use crate::vector::length;
    use crate::{make_mesh, obj};

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
                          vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt .5 1\n";

    fn made(text: &str) -> ImportedMesh {
        let obj = obj::parse(text.as_bytes()).unwrap();
        let (mesh, layout) = make_mesh(&obj, (256, 256)).unwrap();
        assert_eq!(layout.size(), (256, 256));
        mesh
    }

    /// Returns each face's corners.
    fn faces(mesh: &ImportedMesh) -> Vec<Vec<Corner>> {
        let mut rest = &mesh.corners[..];
        let faces = mesh.faces.iter().map(|face| {
            let (corners, after) = rest.split_at(face.corners.into());
            rest = after;
            corners.to_vec()
        });
        let faces = faces.collect();
        assert!(rest.is_empty());
        faces
    }

    /// Returns twice a face's area along its normal, in square units; negative if the face is inside out.
    fn area(mesh: &ImportedMesh, face: &MeshFace, corners: &[Corner]) -> f64 {
        let at = |i: usize| mesh.vertices[usize::from(corners[i].vertex)].map(f64::from);
        let sides =
            (1..corners.len() - 1).map(|i| cross(minus(at(i + 1), at(0)), minus(at(i), at(0))));
        let normal = face.normal.map(|k| f64::from(k) / 16_384.0);
        sides.map(|side| dot(side, normal)).sum::<f64>() / (GRID * GRID)
    }

    #[test]
    fn a_flat_convex_face_of_one_texture_plane_stays_whole() {
        let mesh = made(&format!("{SQUARE}f 1/1 2/2 3/3 4/4\n"));
        assert_eq!(mesh.counts, FaceCounts::default());
        let [face] = &faces(&mesh)[..] else {
            panic!("{mesh:?}");
        };
        // Seen from the front, y points up in the file, so the corners are clockwise from some corner.
        let side = 256 << 16;
        let r = (RADIUS * GRID / 2f64.sqrt()).round() as i32;
        let clockwise = [
            [r, r, side, side],
            [-r, r, 0, side],
            [-r, -r, 0, 0],
            [r, -r, side, 0],
        ];
        let found: Vec<_> = face
            .iter()
            .map(|corner| {
                let [x, y, z] = mesh.vertices[usize::from(corner.vertex)];
                assert_eq!(z, 0);
                [x, y, corner.u, corner.v]
            })
            .collect();
        let first = clockwise
            .iter()
            .position(|corner| *corner == found[0])
            .unwrap();
        assert!(
            (0..4).all(|i| found[i] == clockwise[(first + i) % 4]),
            "{found:?}"
        );
        // The face points at a viewer in front of the screen.
        assert_eq!(mesh.faces[0].normal, [0, 0, -16_384]);
    }

    #[test]
    fn any_other_face_is_cut_into_triangles_with_the_same_area() {
        let bent = SQUARE.replace("v 1 1 0", "v 1 1 .2");
        let rim = |n: usize| {
            let radius = |i| if n == 24 && i % 2 == 1 { 0.4 } else { 1.0 };
            let (mut text, mut face) = (String::new(), String::from("f"));
            for i in 0..n {
                let (s, c) = (i as f64 / n as f64 * std::f64::consts::TAU).sin_cos();
                text += &format!("v {} {} 0\n", radius(i) * c, radius(i) * s);
                face += &format!(" {}", i + 1);
            }
            format!("{text}{face}\n")
        };
        let sized = |area: f64| area * RADIUS * RADIUS;
        for (text, pieces, expected) in [
            (format!("{SQUARE}f 1/1 2/2 3/3 4/5\n"), 2, sized(4.0)),
            (format!("{bent}f 1/1 2/2 3/3 4/4\n"), 2, 0.0),
            // A concave corner.
            (
                "v 0 0 0\nv 2 0 0\nv .5 .5 0\nv 0 2 0\nf 1 2 3 4\n".into(),
                2,
                0.0,
            ),
            (rim(11), 1, 0.0),
            (
                rim(10),
                1,
                sized(10.0 * (std::f64::consts::TAU / 10.0).sin()),
            ),
            (
                rim(12),
                10,
                sized(12.0 * (std::f64::consts::TAU / 12.0).sin()),
            ),
            // A star with twelve points.
            (
                rim(24),
                22,
                sized(24.0 * 0.4 * (std::f64::consts::TAU / 24.0).sin()),
            ),
        ] {
            let obj = obj::parse(text.as_bytes()).unwrap();
            let (mesh, _) = make_mesh(&obj, (256, 256)).unwrap();
            assert_eq!(mesh.faces.len(), pieces, "{text}");
            assert_eq!(mesh.counts.cut, usize::from(pieces > 1));
            let areas = mesh.faces.iter().zip(faces(&mesh));
            let areas: Vec<_> = areas
                .map(|(face, corners)| area(&mesh, face, &corners))
                .collect();
            assert!(areas.iter().all(|&area| area > 0.0), "{text}: {areas:?}");
            let sum: f64 = areas.iter().sum();
            assert!(
                expected == 0.0 || (sum - expected).abs() < 1e-3,
                "{sum}, {expected}"
            );
            // The light shows no cuts.
            assert!(
                mesh.faces
                    .iter()
                    .all(|face| face.normal == mesh.faces[0].normal)
            );
        }
    }

    #[test]
    fn the_three_corners_of_the_texture_plane_are_not_collinear() {
        // The middle of the lower side is a corner as well, so that some choices of three corners make a
        // narrow triangle.
        let text = format!("{SQUARE}v .5 0 0\nvt .5 0\nf 1/1 5/6 2/2 3/3 4/4\n");
        let mesh = made(&text);
        let [face] = &faces(&mesh)[..] else {
            panic!("{mesh:?}");
        };
        let three = [0, 5 / 3, 10 / 3].map(|i: usize| face[i]);
        assert!(area(&mesh, &mesh.faces[0], &three) > 0.5);
    }

    #[test]
    fn faces_without_an_area_are_dropped_and_equal_points_are_merged() {
        let text = format!(
            "{SQUARE}v 1 1 0.0000001\no two\nf 1/1 2/2 5/3 4/4\n\
             f 1 1 2\nf 1 2\nf 3 5 1\nf\nf 1 2 3 2\nf 1 1 2 2 3 5\n"
        );
        let mesh = made(&text);
        assert_eq!(mesh.vertices.len(), 4);
        assert_eq!(mesh.counts.degenerate, 5);
        assert_eq!(mesh.faces.len(), 2);
        assert_eq!(faces(&mesh)[1].len(), 3);
    }

    #[test]
    fn generated_coordinates_put_the_texture_on_each_side_of_a_box_without_mirroring() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
                    f 5 6 7 8\nf 2 1 4 3\nf 6 2 3 7\nf 1 5 8 4\nf 8 7 3 4\nf 1 2 6 5\n";
        let obj = obj::parse(text.as_bytes()).unwrap();
        let (mesh, layout) = make_mesh(&obj, (256, 256)).unwrap();
        assert_eq!((mesh.counts.projected, mesh.faces.len()), (6, 6));
        // The cube's edge is 1.15 times the radius of its ball, so it covers 1.15 of the projection's 2.
        assert_eq!(layout.size(), (148, 148));
        for (face, corners) in mesh.faces.iter().zip(faces(&mesh)) {
            assert!(area(&mesh, face, &corners) > 0.0);
            // Corners that are clockwise on the screen are clockwise in the texture, so nothing is mirrored.
            let [a, b, c] = [0, 1, 2].map(|i: usize| [corners[i].u, corners[i].v].map(f64::from));
            let turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            assert!(turn > 0.0, "{corners:?}");
        }
    }

    #[test]
    fn a_model_of_any_size_and_position_is_scaled_to_fit_its_ball() {
        for (scale, shift) in [
            (1.0, 0.0),
            (1e-6, 1.0),
            (1e20, 0.0),
            (1e3, -1e6),
            (1e-100, 0.0),
        ] {
            let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
            let vertex = |(x, y)| format!("v {:e} {:e} 3\n", x * scale + shift, y * scale + shift);
            let text = square.map(vertex).concat() + "f 1 2 3 4\n";
            let mesh = made_small(&text);
            let far = |vertex: &Vec3| length(vertex.map(f64::from)) / GRID;
            for vertex in &mesh.vertices {
                assert!(
                    (far(vertex) - RADIUS).abs() < 1e-4,
                    "{scale} {shift}: {vertex:?}"
                );
            }
        }
    }

    fn made_small(text: &str) -> ImportedMesh {
        make_mesh(&obj::parse(text.as_bytes()).unwrap(), (256, 256))
            .unwrap()
            .0
    }
}
