//! The scene renderer: owns the prepared scene and the arenas.

use modex::{Destination, HEIGHT, Palette};
use scene::clip::ViewPoint;
use scene::{MAX_CORNERS, MAX_EXTENT, MAX_FACES, MAX_VERTICES, Mesh, Pose, Scene};
use texmap::{JobList, Texture, Visible};

use crate::options::{Drawn, RenderOptions};
use crate::posed::{MAX_JOBS, PosedScene};
use crate::surfaces::{SURFACE_BYTES, Surfaces};

/// Fixed arenas for drawing.
#[derive(Clone, Copy, Debug)]
pub struct RenderMemory {
    surfaces: [u8; SURFACE_BYTES],
    points: [ViewPoint; MAX_VERTICES],
    visible: Visible<MAX_FACES>,
    jobs: JobList<MAX_JOBS>,
}

impl RenderMemory {
    /// Returns empty arenas, about 2.6 MiB. They are meant for a static.
    pub const fn new() -> Self {
        Self {
            surfaces: [0; SURFACE_BYTES],
            points: [ViewPoint::ORIGIN; MAX_VERTICES],
            visible: Visible::new(),
            jobs: JobList::new(),
        }
    }
}

impl Default for RenderMemory {
    fn default() -> Self {
        Self::new()
    }
}

/// A scene that is ready to be drawn: its textures are lit, and its limits are checked.
#[derive(Debug)]
pub struct SceneRenderer<'a> {
    name: &'static str,
    mesh: Mesh<'a>,
    palette: &'a Palette,
    background: &'a [u8; HEIGHT],
    surfaces: Surfaces<'a>,
    points: &'a mut [ViewPoint; MAX_VERTICES],
    visible: &'a mut Visible<MAX_FACES>,
    jobs: &'a mut JobList<MAX_JOBS>,
}

impl<'a> SceneRenderer<'a> {
    /// Returns a renderer of `scene`, whose textures it lights into `memory`.
    ///
    /// # Panics
    /// As [`SceneRenderer::set`].
    pub fn new(memory: &'a mut RenderMemory, scene: Scene<'a, '_>) -> Self {
        let RenderMemory {
            surfaces,
            points,
            visible,
            jobs,
        } = memory;
        let mut renderer = Self {
            name: scene.name,
            mesh: scene.mesh,
            palette: scene.palette,
            background: scene.background,
            surfaces: Surfaces::new(surfaces),
            points,
            visible,
            jobs,
        };
        renderer.set(scene);
        renderer
    }

    /// Replaces the scene, and lights its textures.
    ///
    /// # Panics
    /// If the scene is larger than the arenas: more than [`MAX_VERTICES`] vertices; for a mesh that is not
    /// convex, more than [`MAX_FACES`] faces; more than 16 textures, each mipmap counted; or textures of more
    /// than [`SURFACE_BYTES`] / [`LIGHT_LEVELS`](scene::LIGHT_LEVELS) texels together, each padded to powers
    /// of two. Also if a face has fewer than 3 or more than [`MAX_CORNERS`] corners, or if a vertex is
    /// further out than [`MAX_EXTENT`].
    pub fn set(&mut self, scene: Scene<'a, '_>) {
        let (vertices, faces) = (scene.mesh.vertices.len(), scene.mesh.faces.len());
        assert!(
            vertices <= MAX_VERTICES,
            "{}: the mesh has {vertices} vertices; at most {MAX_VERTICES} fit",
            scene.name
        );
        assert!(
            scene.mesh.convex || faces <= MAX_FACES,
            "{}: the mesh is not convex and has {faces} faces; at most {MAX_FACES} fit",
            scene.name
        );
        for (i, face) in scene.mesh.faces.iter().enumerate() {
            assert!(
                (3..=MAX_CORNERS).contains(&usize::from(face.corners)),
                "{}: face {i} has {} corners; clipping leaves room for 3 to {MAX_CORNERS}",
                scene.name,
                face.corners,
            );
        }
        for (i, vertex) in scene.mesh.vertices.iter().enumerate() {
            assert!(
                vertex
                    .iter()
                    .all(|k| (-MAX_EXTENT..=MAX_EXTENT).contains(k)),
                "{}: vertex {i} is at {vertex:?}, outside +-{MAX_EXTENT}",
                scene.name
            );
        }
        self.surfaces.set(&scene);
        self.name = scene.name;
        self.mesh = scene.mesh;
        self.palette = scene.palette;
        self.background = scene.background;
    }

    /// Returns the scene's name.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Returns whether no face hides a part of another.
    pub fn is_convex(&self) -> bool {
        self.mesh.convex
    }

    /// Returns the DAC's colours.
    pub fn palette(&self) -> &'a Palette {
        self.palette
    }

    /// Returns the colour of each scan line where no solid covers it.
    pub fn background(&self) -> &'a [u8; HEIGHT] {
        self.background
    }

    /// Returns the lit texture with the number in a polygon's [`Face`](texmap::Face).
    pub fn surface(&self, number: u16) -> Texture<'_> {
        self.surfaces.texture(number)
    }

    /// Returns the scene in `pose`.
    ///
    /// At a distance outside 0 to [`Pose::MAX_DISTANCE`] every face is dropped. At other distances a face is
    /// dropped only if clipping leaves it too many corners.
    pub fn at(&mut self, pose: &Pose) -> PosedScene<'_> {
        PosedScene::new(
            self.mesh,
            &self.surfaces,
            pose,
            self.points,
            self.visible,
            self.jobs,
        )
    }

    /// Draws the solid in `pose` on a destination that contains the background.
    pub fn draw(
        &mut self,
        pose: &Pose,
        options: RenderOptions,
        destination: &mut impl Destination,
    ) -> Drawn {
        self.at(pose).draw(options, destination)
    }
}
