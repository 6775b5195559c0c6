//! A scene in a pose: its front faces on the screen, and which of them is visible at each pixel.
//!
//! Every frame of a pose, exact or fast, in colours or as errors, is made of the same faces. So the vertices
//! are turned and projected once, and the hidden surfaces are found once, however many frames of the pose are
//! drawn.

use modex::Destination;
use scene::clip::{ViewPoint, place};
use scene::{FOCAL_LENGTH, MAX_FACES, Mesh, Orientation, Pose, lit_level};
use texmap::plane::Anchor;
use texmap::{Face, JobList, MAX_SIDES, Renderer, Vertex, Visible};

use crate::options::{Drawn, RenderOptions};
use crate::quality::MapperChoice;
use crate::surfaces::Surfaces;

/// Most jobs that are collected before they are drawn.
pub const MAX_JOBS: usize = 4096;

/// A scene in a pose, as [`SceneRenderer::at`](crate::SceneRenderer::at) returns it.
#[derive(Debug)]
pub struct PosedScene<'r> {
    pub(crate) pose: Pose,
    pub(crate) faces: FrontFaces<'r>,
    /// The visible face at each pixel, or `None` if no face of the mesh can hide another.
    pub(crate) visible: Option<&'r Visible<MAX_FACES>>,
    jobs: &'r mut JobList<MAX_JOBS>,
}

impl<'r> PosedScene<'r> {
    /// Turns and projects the vertices of `mesh` into `points`, and finds the visible faces if `mesh` is not
    /// convex.
    pub(crate) fn new(
        mesh: Mesh<'r>,
        surfaces: &'r Surfaces<'r>,
        pose: &Pose,
        points: &'r mut [ViewPoint],
        visible: &'r mut Visible<MAX_FACES>,
        jobs: &'r mut JobList<MAX_JOBS>,
    ) -> Self {
        let orientation = pose.orientation();
        let is_legal = (0..=Pose::MAX_DISTANCE).contains(&pose.distance);
        if is_legal {
            for (point, &vertex) in points.iter_mut().zip(mesh.vertices) {
                let [x, y, z] = orientation.turn(vertex);
                *point = ViewPoint::new([x, y, z + pose.distance]);
            }
        }
        let faces = FrontFaces {
            mesh,
            surfaces,
            orientation,
            points: is_legal.then_some(points),
        };
        let visible = (!mesh.convex).then(|| {
            visible.clear();
            faces.each(|number, face| {
                if let Some(face) = face {
                    // A face out of range is out of range for the mapper too, which counts it.
                    let _ = visible.add(number, &face);
                }
            });
            visible.finish();
            &*visible
        });
        Self {
            pose: *pose,
            faces,
            visible,
            jobs,
        }
    }

    /// Passes the front faces to `sink` in the mesh's order, each with its number in the mesh. `sink`
    /// receives `None` for a dropped face.
    pub fn faces(&self, sink: impl FnMut(u16, Option<Face<'_>>)) {
        self.faces.each(sink);
    }

    /// Returns the visible face at each pixel, or `None` if no face of the mesh can hide another.
    pub fn visible(&self) -> Option<&Visible<MAX_FACES>> {
        self.visible
    }

    /// Draws the solid on a destination that contains the background.
    pub fn draw(&mut self, options: RenderOptions, destination: &mut impl Destination) -> Drawn {
        let RenderOptions { mapper, order, .. } = options;
        let textures = self.faces.surfaces.textures();
        let choice = MapperChoice::new(&options, &self.pose);
        let mut reduced = 0;
        let mut renderer = Renderer::new(self.jobs, &textures, destination, mapper, order);
        self.faces.each(|number, face| {
            let Some(face) = face else {
                return renderer.drop_face();
            };
            let chosen = choice.mapper(&face);
            reduced += u32::from(chosen != mapper);
            renderer.set_mapper(chosen);
            match self.visible {
                None => renderer.face(&face),
                Some(visible) => renderer.seen_face(&face, visible, number),
            }
        });
        Drawn {
            stats: renderer.finish(),
            reduced,
        }
    }
}

/// The faces of a mesh in a pose that look at the viewer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrontFaces<'r> {
    mesh: Mesh<'r>,
    pub(crate) surfaces: &'r Surfaces<'r>,
    orientation: Orientation,
    /// The vertices, or `None` at a distance outside the legal range.
    points: Option<&'r [ViewPoint]>,
}

impl FrontFaces<'_> {
    /// Passes the faces to `sink` as [`PosedScene::faces`] does.
    pub fn each(&self, mut sink: impl FnMut(u16, Option<Face<'_>>)) {
        let mut polygon = [Vertex::default(); MAX_SIDES];
        for (number, face) in (0..).zip(self.mesh.faces) {
            let corners =
                &self.mesh.corners[usize::from(face.first)..][..usize::from(face.corners)];
            let placed = self
                .points
                .and_then(|points| Some((points, place(corners, points, &mut polygon)?)));
            let Some((points, sides)) = placed else {
                sink(number, None);
                continue;
            };
            let polygon = &mut polygon[..sides];
            if !looks_at_viewer(polygon) {
                continue;
            }
            let mip = self.surfaces.mipmap(polygon);
            for vertex in &mut *polygon {
                (vertex.u, vertex.v) = (vertex.u >> mip, vertex.v >> mip);
            }
            let level = lit_level(self.orientation.turn(face.normal));
            // A third of the corners apart, so that the anchors of a face with many corners do not lie on a
            // line.
            let anchors = [0, corners.len() / 3, 2 * corners.len() / 3].map(|i| Anchor {
                position: points[usize::from(corners[i].vertex)].view(),
                u: corners[i].u >> mip,
                v: corners[i].v >> mip,
            });
            let face = Face {
                polygon,
                texture: self.surfaces.number(face.texture, mip, level),
                anchors,
                focal_length: FOCAL_LENGTH,
            };
            sink(number, Some(face));
        }
    }
}

/// Returns whether the snapped polygon is wound clockwise on the screen (y down), which makes it a front
/// face.
///
/// The snapped area decides, not the normal, because the snapped polygon is drawn, and snapping may turn over
/// a face that is seen edge-on. A face that clipping removed has no area.
fn looks_at_viewer(polygon: &[Vertex]) -> bool {
    let mut area = 0i64;
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        area += i64::from(a.x) * i64::from(b.y) - i64::from(b.x) * i64::from(a.y);
    }
    area > 0
}
