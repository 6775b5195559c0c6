//! From an OBJ's faces to polygons on the mesh's grid.
//!
//! The model is centred and scaled so that a ball of [`RADIUS`] contains it: at the default distance it fits
//! the screen in every orientation. Then its points are rounded to the mesh's grid, and equal points become
//! one vertex. Every later decision is made on the grid, because the kernel sees nothing else.
//!
//! # Missing texture coordinates
//!
//! A face without texture coordinates gets them by projection onto a box around the model's centre. The
//! largest component of the face's normal says which side of the box the face is on, and each side has the
//! whole texture once. Such a face always has one texture plane and no seam, and the projection stretches
//! the texture by at most the square root of three.

use std::collections::HashMap;

use anyhow::ensure;
use scene::{MAX_FACES, MAX_VERTICES, Vec3};

use crate::obj::{BadLine, Obj, SIMPLIFY};
use crate::vector::{cross, length, minus};

/// The radius of the ball that contains the model, in units. From the default distance of 2.95 units, the
/// ball's outline is 115 pixels from the screen's centre, of the 120 to the edge.
pub const RADIUS: f64 = 1.2;
/// One unit on the mesh's grid.
pub(crate) const GRID: f64 = 65_536.0;

/// Counts of the file's faces that were not imported unchanged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FaceCounts {
    /// Faces without an area, which were dropped.
    pub degenerate: usize,
    /// Faces that were cut into triangles, because they are not convex, not flat, have too many corners or
    /// have no single texture plane.
    pub cut: usize,
    /// Faces without texture coordinates, which got projected coordinates.
    pub projected: usize,
}

/// A polygon on the grid, with an area, clockwise when seen from its front.
#[derive(Clone, Debug)]
pub struct Polygon {
    pub(crate) ring: Vec<PolygonCorner>,
    pub(crate) normal: [f64; 3],
    /// The line of the face in the file.
    pub line: usize,
}

/// A corner of a polygon.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PolygonCorner {
    pub(crate) vertex: usize,
    /// The position on the mesh's grid.
    pub(crate) at: [f64; 3],
    /// The position in the texture, in whole textures, to the right and down.
    uv: [f64; 2],
}

impl Polygon {
    /// Returns the corners' positions in the texture along an axis, in whole textures: to the right (0) or
    /// down (1).
    pub fn along(&self, axis: usize) -> impl Iterator<Item = f64> {
        self.ring.iter().map(move |place| place.uv[axis])
    }

    /// Sets texture coordinates by projection onto a box.
    fn project(&mut self) {
        let side = (0..3).fold(0, |a, b| {
            if self.normal[b].abs() > self.normal[a].abs() {
                b
            } else {
                a
            }
        });
        // The directions to the right and down on that side of the box, when seen from outside. The top and
        // the bottom are seen with the front's edge nearest.
        let outward = self.normal[side].signum();
        let (across, down, turned) = match side {
            0 => (2, 1, outward),
            1 => (0, 2, outward),
            _ => (0, 1, -outward),
        };
        for place in &mut self.ring {
            let part = |k: usize| place.at[k] / (2.0 * RADIUS * GRID);
            place.uv = match side {
                1 => [0.5 + part(across), 0.5 + turned * part(down)],
                _ => [0.5 + turned * part(across), 0.5 + part(down)],
            };
        }
    }
}

/// The polygons of a file, on the grid.
#[derive(Clone, Debug, Default)]
pub struct Polygons {
    pub(crate) vertices: Vec<Vec3>,
    /// The polygons that have an area.
    pub polygons: Vec<Polygon>,
    pub(crate) counts: FaceCounts,
}

impl Polygons {
    /// Puts an OBJ's faces on the grid, with the model centred and scaled to fit.
    ///
    /// # Errors
    /// If no face has an area, or there are more vertices or faces than a mesh may have.
    pub fn new(obj: &Obj) -> anyhow::Result<Self> {
        ensure!(
            !obj.faces.is_empty(),
            "the file has no faces (lines such as 'f 1 2 3'), but {} vertices, and {}; export the model \
             as polygons",
            obj.positions.len(),
            obj.skipped
        );
        let corners = obj.corners.iter();
        let used: Vec<_> = corners
            .map(|corner| obj.positions[corner.position as usize])
            .collect();
        let centre = [0, 1, 2].map(|k| {
            let along = used.iter().map(|position| position[k]);
            (along.clone().fold(f64::INFINITY, f64::min) + along.fold(-f64::INFINITY, f64::max))
                / 2.0
        });
        let from_centre = |position: [f64; 3]| [0, 1, 2].map(|k| position[k] - centre[k]);
        let lengths = used.iter().map(|&position| length(from_centre(position)));
        let scale = RADIUS * GRID / lengths.fold(0.0, f64::max);
        // From y up and z towards the viewer to y down and z away: half a turn about x. All points of a
        // model without an extent go to the centre.
        let on_grid = |position| {
            let [x, y, z] =
                from_centre(position).map(|k| if scale.is_finite() { k * scale } else { 0.0 });
            [x, -y, -z].map(|k| k.round() as i32)
        };

        let mut this = Self::default();
        let mut known = HashMap::new();
        for face in &obj.faces {
            let mut ring: Vec<_> = obj
                .corners_of(face)
                .iter()
                // Counter-clockwise in the file.
                .rev()
                .map(|corner| {
                    let point = on_grid(obj.positions[corner.position as usize]);
                    let vertex = *known.entry(point).or_insert_with(|| {
                        this.vertices.push(point);
                        this.vertices.len() - 1
                    });
                    PolygonCorner {
                        vertex,
                        at: point.map(f64::from),
                        // v points up in the file.
                        uv: corner.uv.map_or([f64::NAN; 2], |place| {
                            let [u, v] = obj.texture_coordinates[place as usize];
                            [u, -v]
                        }),
                    }
                })
                .collect();
            ring.dedup_by_key(|place| place.vertex);
            while ring.len() > 1 && ring[0].vertex == ring[ring.len() - 1].vertex {
                ring.pop();
            }
            let Some(normal) = normal(&ring) else {
                this.counts.degenerate += 1;
                continue;
            };
            let mut polygon = Polygon {
                ring,
                normal,
                line: face.line,
            };
            if polygon.along(0).any(f64::is_nan) {
                polygon.project();
                this.counts.projected += 1;
            }
            this.polygons.push(polygon);
            for (what, count, most, all) in [
                ("faces", this.polygons.len(), MAX_FACES, obj.faces.len()),
                (
                    "vertices",
                    this.vertices.len(),
                    MAX_VERTICES,
                    obj.positions.len(),
                ),
            ] {
                if count > most {
                    let why = format!(
                        "with this face the model has more than {most} {what} (the file has \
                         {all}); {SIMPLIFY}"
                    );
                    let line = face.line;
                    return Err(BadLine { line, why }.into());
                }
            }
        }
        ensure!(
            !this.polygons.is_empty(),
            "none of the {} faces has an area; check the vertices",
            obj.faces.len()
        );
        Ok(this)
    }
}

/// Returns the unit normal on the side from which the ring is clockwise, or `None` if the ring has no area.
fn normal(ring: &[PolygonCorner]) -> Option<[f64; 3]> {
    let mut sum = [0.0; 3];
    // Relative to the first corner, so that the terms are as small as the polygon.
    for pair in ring.windows(2).skip(1) {
        let term = cross(minus(pair[1].at, ring[0].at), minus(pair[0].at, ring[0].at));
        sum = [0, 1, 2].map(|k| sum[k] + term[k]);
    }
    let length = length(sum);
    (length > 0.0).then(|| sum.map(|k| k / length))
}
