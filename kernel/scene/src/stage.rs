//! A scene made ready, and the way from a pose to polygons.

mod errors;

use modex::{Destination, HEIGHT, Palette};
use texmap::plane::Anchor;
use texmap::{Face, JobList, MAX_SIDES, Mapper, Order, Renderer, Stats, Texture, Vertex, Visible};

use crate::clip::{Point, place};
use crate::colour::{LIGHT_LEVELS, LightTable, lit_level};
use crate::{FOCAL_LENGTH, MAX_CORNERS, MAX_EXTENT, Mesh, Pose};

/// Most vertices of a mesh.
pub const MAX_VERTICES: usize = 4096;
/// Most faces of a mesh that is not convex: each is known by a number until the picture is drawn.
pub const MAX_FACES: usize = 8192;
/// Column jobs that are collected before they are drawn.
pub const MAX_JOBS: usize = 4096;
/// Room for a scene's textures, each padded and once per light level: one of the largest.
pub const SURFACE_BYTES: usize = 3 << 19;
/// Most textures of a scene.
const MAX_TEXTURES: usize = 8;

/// What is seen: a solid, what covers it, and the colours of everything.
///
/// `'t` is the textures' life: a stage makes its own lit copies and needs them no longer.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a, 't> {
    /// Name, for people.
    pub name: &'static str,
    /// The solid, about the origin.
    pub mesh: Mesh<'a>,
    /// Textures in full light.
    pub textures: &'t [Texture<'t>],
    /// The DAC's colours.
    pub palette: &'a Palette,
    /// What a colour becomes at a light level.
    pub light: &'t LightTable,
    /// The colour of each scan line where there is no solid.
    pub background: &'a [u8; HEIGHT],
}

/// The fixed arenas that drawing works in.
#[derive(Debug)]
pub struct Storage {
    surfaces: [u8; SURFACE_BYTES],
    points: [Point; MAX_VERTICES],
    visible: Visible<MAX_FACES>,
    jobs: JobList<MAX_JOBS>,
}

impl Storage {
    /// Empty arenas. About 3 MiB: meant for a static.
    pub const fn new() -> Self {
        Self {
            surfaces: [0; SURFACE_BYTES],
            points: [Point::ORIGIN; MAX_VERTICES],
            visible: Visible::new(),
            jobs: JobList::new(),
        }
    }
}

impl Default for Storage {
    fn default() -> Self {
        Self::new()
    }
}

/// Where a texture's lit copies are: one for each light level, one after the other.
#[derive(Clone, Copy, Debug, Default)]
struct Surface {
    first: usize,
    width: u16,
    height: u16,
}

impl Surface {
    /// The copy of a light level.
    fn lit<'t>(&self, level: usize, texels: &'t [u8; SURFACE_BYTES]) -> Texture<'t> {
        let (width, height) = (self.width, self.height);
        let len = Texture::padded_len(width, height);
        let texels = &texels[self.first + level * len..][..len];
        Texture::padded(texels, width, height).expect("a lit copy has the sides of its texture")
    }
}

/// A scene with its textures lit.
///
/// Light would cost the mapper a second look-up for every pixel. A face has one light level, so
/// each texture is run through the light table once per level when the scene is set, and a face
/// takes the copy that fits: the mapper's loop knows nothing of light.
#[derive(Debug)]
pub struct Stage<'a> {
    name: &'static str,
    mesh: Mesh<'a>,
    palette: &'a Palette,
    background: &'a [u8; HEIGHT],
    mapper: Mapper,
    order: Order,
    surfaces: [Surface; MAX_TEXTURES],
    texels: &'a mut [u8; SURFACE_BYTES],
    points: &'a mut [Point; MAX_VERTICES],
    visible: &'a mut Visible<MAX_FACES>,
    jobs: &'a mut JobList<MAX_JOBS>,
}

impl<'a> Stage<'a> {
    /// Lights the textures of `scene` into `storage`.
    ///
    /// # Panics
    /// As [`Stage::set`].
    pub fn new(storage: &'a mut Storage, scene: Scene<'a, '_>) -> Self {
        let Storage {
            surfaces,
            points,
            visible,
            jobs,
        } = storage;
        let mut stage = Self {
            name: scene.name,
            mesh: scene.mesh,
            palette: scene.palette,
            background: scene.background,
            mapper: Mapper::default(),
            order: Order::default(),
            surfaces: [Surface::default(); MAX_TEXTURES],
            texels: surfaces,
            points,
            visible,
            jobs,
        };
        stage.set(scene);
        stage
    }

    /// Puts another scene on the stage, its textures lit.
    ///
    /// # Panics
    /// If the scene is larger than the arenas: more than [`MAX_VERTICES`] vertices, or, if the mesh is
    /// not convex, [`MAX_FACES`] faces, or textures
    /// of more than [`SURFACE_BYTES`] / [`LIGHT_LEVELS`] texels together, each padded to powers of
    /// two. If a face has fewer than 3 or more than [`MAX_CORNERS`] corners, or a vertex is further
    /// out than [`MAX_EXTENT`].
    pub fn set(&mut self, scene: Scene<'a, '_>) {
        assert!(
            scene.mesh.vertices.len() <= MAX_VERTICES && scene.textures.len() <= MAX_TEXTURES,
            "the scene has {} vertices and {} textures; the arenas hold {MAX_VERTICES} and {MAX_TEXTURES}",
            scene.mesh.vertices.len(),
            scene.textures.len(),
        );
        let faces = scene.mesh.faces.len();
        assert!(
            scene.mesh.convex || faces <= MAX_FACES,
            "a mesh that is not convex has {faces} faces; the arenas hold {MAX_FACES}",
        );
        for (i, face) in scene.mesh.faces.iter().enumerate() {
            assert!(
                (3..=MAX_CORNERS).contains(&usize::from(face.corners)),
                "face {i} has {} corners; clipping leaves room for 3 to {MAX_CORNERS}",
                face.corners,
            );
        }
        for (i, vertex) in scene.mesh.vertices.iter().enumerate() {
            assert!(
                vertex
                    .iter()
                    .all(|k| (-MAX_EXTENT..=MAX_EXTENT).contains(k)),
                "vertex {i} is at {vertex:?}, outside +-{MAX_EXTENT}",
            );
        }
        let mut free = 0;
        self.surfaces = [Surface::default(); MAX_TEXTURES];
        for (texture, surface) in scene.textures.iter().zip(&mut self.surfaces) {
            let (width, height) = (texture.width(), texture.height());
            let len = Texture::padded_len(width, height);
            *surface = Surface {
                first: free,
                width,
                height,
            };
            let pitch = usize::from(width).next_power_of_two();
            for light in scene.light {
                let lit = self
                    .texels
                    .get_mut(free..free + len)
                    .expect("the scene's textures are larger than the surface arena");
                free += len;
                let rows = texture.texels().chunks_exact(texture.pitch().into());
                for (lit, row) in lit.chunks_exact_mut(pitch).zip(rows) {
                    for (lit, &texel) in lit.iter_mut().zip(&row[..width.into()]) {
                        *lit = light[usize::from(texel)];
                    }
                }
            }
        }
        self.name = scene.name;
        self.mesh = scene.mesh;
        self.palette = scene.palette;
        self.background = scene.background;
    }

    /// The scene's name.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Whether no face hides a part of another.
    pub fn is_convex(&self) -> bool {
        self.mesh.convex
    }

    /// The DAC's colours.
    pub fn palette(&self) -> &'a Palette {
        self.palette
    }

    /// The colour of each scan line where there is no solid.
    pub fn background(&self) -> &'a [u8; HEIGHT] {
        self.background
    }

    /// A texture in the light of a face, by the number that [`Face`] has.
    pub fn surface(&self, number: u16) -> Texture<'_> {
        let number = usize::from(number);
        self.surfaces[number / LIGHT_LEVELS].lit(number % LIGHT_LEVELS, self.texels)
    }

    /// How pictures are mapped.
    pub fn mapper(&self) -> Mapper {
        self.mapper
    }

    /// Has the next pictures mapped in another way.
    pub fn set_mapper(&mut self, mapper: Mapper) {
        self.mapper = mapper;
    }

    /// In which order a picture's runs are drawn.
    pub fn order(&self) -> Order {
        self.order
    }

    /// Has the next pictures' runs drawn in another order.
    pub fn set_order(&mut self, order: Order) {
        self.order = order;
    }

    /// Draws the solid in `pose` on a destination that holds the background. At a distance outside
    /// 0 to [`Pose::MAX_DISTANCE`] every face is dropped; at any other none is.
    pub fn draw(&mut self, pose: &Pose, destination: &mut impl Destination) -> Stats {
        if !self.mesh.convex {
            self.find_visible(pose);
        }
        let (mapper, order) = (self.mapper, self.order);
        let mut surfaces = [Texture::DOT; MAX_TEXTURES * LIGHT_LEVELS];
        let lit = surfaces.chunks_exact_mut(LIGHT_LEVELS);
        for (surface, lit) in self.surfaces.iter().zip(lit) {
            if surface.width > 0 {
                for (level, lit) in lit.iter_mut().enumerate() {
                    *lit = surface.lit(level, self.texels);
                }
            }
        }
        let visible = &*self.visible;
        let mut renderer = Renderer::new(self.jobs, &surfaces, destination, mapper, order);
        polygons(&self.mesh, self.points, pose, |number, face| match face {
            None => renderer.drop_face(),
            Some(face) if self.mesh.convex => renderer.face(&face),
            Some(face) => renderer.seen_face(&face, visible, number),
        });
        renderer.finish()
    }

    /// Finds out which of the mesh's faces, of at most [`MAX_FACES`], is seen at each pixel.
    pub fn find_visible(&mut self, pose: &Pose) -> &Visible<MAX_FACES> {
        self.visible.clear();
        polygons(&self.mesh, self.points, pose, |number, face| {
            if let Some(face) = face {
                // What is out of range here is so again for the mapper, which counts it.
                let _ = self.visible.add(number, &face);
            }
        });
        self.visible.finish();
        self.visible
    }

    /// Gives `sink` the faces that look at the viewer, in the mesh's order, each with its number
    /// there; nothing for a face that is dropped.
    pub fn polygons(&mut self, pose: &Pose, sink: impl FnMut(u16, Option<Face<'_>>)) {
        polygons(&self.mesh, self.points, pose, sink);
    }
}

/// The faces that look at the viewer, in the mesh's order, each with its number there.
fn polygons(
    mesh: &Mesh<'_>,
    points: &mut [Point; MAX_VERTICES],
    pose: &Pose,
    mut sink: impl FnMut(u16, Option<Face<'_>>),
) {
    if !(0..=Pose::MAX_DISTANCE).contains(&pose.distance) {
        return (0..)
            .zip(mesh.faces)
            .for_each(|(number, _)| sink(number, None));
    }
    let orientation = pose.orientation();
    for (point, &vertex) in points.iter_mut().zip(mesh.vertices) {
        let [x, y, z] = orientation.turn(vertex);
        *point = Point::new([x, y, z + pose.distance]);
    }
    let mut polygon = [Vertex::default(); MAX_SIDES];
    for (number, face) in (0..).zip(mesh.faces) {
        let corners = &mesh.corners[usize::from(face.first)..][..usize::from(face.corners)];
        let Some(sides) = place(corners, points, &mut polygon) else {
            sink(number, None);
            continue;
        };
        let polygon = &polygon[..sides];
        if looks_at_viewer(polygon) {
            let level = lit_level(orientation.turn(face.normal));
            let surface = usize::from(face.texture) * LIGHT_LEVELS + level;
            // Far from each other, so that of a face with many corners they are not on a line.
            let anchors = [0, corners.len() / 3, 2 * corners.len() / 3].map(|i| Anchor {
                position: points[usize::from(corners[i].vertex)].view(),
                u: corners[i].u,
                v: corners[i].v,
            });
            let face = Face {
                polygon,
                texture: surface as u16,
                anchors,
                focal_length: FOCAL_LENGTH,
            };
            sink(number, Some(face));
        }
    }
}

/// Whether the snapped polygon is wound clockwise on the screen (y down): its front.
///
/// The snapped area decides, not the normal: what is drawn is the snapped polygon, and a face
/// seen edge-on may have turned over in the snapping. What clipping left nothing of has no area.
fn looks_at_viewer(polygon: &[Vertex]) -> bool {
    let mut area = 0i64;
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        area += i64::from(a.x) * i64::from(b.y) - i64::from(b.x) * i64::from(a.y);
    }
    area > 0
}
