//! A scene made ready, and the way from a pose to polygons.

mod errors;
pub mod motion;

use modex::{Destination, HEIGHT, Palette};
use texmap::plane::Anchor;
use texmap::{Face, JobList, MAX_SIDES, Mapper, Order, Renderer, Stats, Texture, Vertex, Visible};

use self::motion::Quality;
use crate::clip::{Point, place};
use crate::colour::{LIGHT_LEVELS, LightTable, MATERIALS, lit_level};
use crate::{FOCAL_LENGTH, MAX_CORNERS, MAX_EXTENT, Mesh, Pose};

/// Most vertices of a mesh.
pub const MAX_VERTICES: usize = 4096;
/// Most faces of a mesh that is not convex: each is known by a number until the picture is drawn.
pub const MAX_FACES: usize = 8192;
/// Column jobs that are collected before they are drawn.
pub const MAX_JOBS: usize = 4096;
/// Room for a scene's textures, each padded and once per light level: one of the largest.
pub const SURFACE_BYTES: usize = 3 << 19;
/// Most textures of a scene, a mipmap counted as one.
const MAX_TEXTURES: usize = 16;
/// Textures made of one that has mipmaps: itself, and down to a sixty-fourth of its sides.
const MIPMAPS: usize = 7;

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
    /// Whether the textures need smaller copies for what is far away. Their sides are powers of two
    /// then, or their tiles'.
    pub mipmaps: bool,
}

/// The fixed arenas that drawing works in.
#[derive(Clone, Copy, Debug)]
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
    /// Of a tiled texture.
    tile: Option<(u16, u16)>,
}

impl Surface {
    /// The copy of a light level.
    fn lit<'t>(&self, level: usize, texels: &'t [u8; SURFACE_BYTES]) -> Texture<'t> {
        let (width, height) = (self.width, self.height);
        let len = self.texels();
        let texels = &texels[self.first + level * len..][..len];
        let texture = match self.tile {
            Some(tile) => Texture::tiled(texels, tile, width, height),
            None => Texture::padded(texels, width, height),
        };
        texture.expect("a lit copy has the sides of its texture")
    }

    /// Texels of a copy.
    fn texels(&self) -> usize {
        let (width, height) = self.sides();
        Texture::padded_len(width, height)
    }

    /// How many there are across and down.
    fn sides(&self) -> (u16, u16) {
        self.tile.unwrap_or((self.width, self.height))
    }

    /// The half of each side, one texel at least, and what is half as large.
    fn halved(self, times: usize) -> Self {
        let part = |side: u16| (side >> times).max(1);
        Self {
            width: part(self.width),
            height: part(self.height),
            tile: self.tile.map(|(width, height)| (part(width), part(height))),
            ..self
        }
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
    /// Textures made of each of the scene's.
    mipmaps: usize,
    mapper: Mapper,
    order: Order,
    /// The pose a tick later, where quality is lower while the solid moves, and faces of the last
    /// picture that were drawn so.
    next: Option<Pose>,
    lowered: u32,
    /// Half the shortest period of the textures, 16.16 texels.
    half_period: Option<u32>,
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
            mipmaps: 1,
            mapper: Mapper::default(),
            order: Order::default(),
            next: None,
            lowered: 0,
            half_period: None,
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
        self.mipmaps = if scene.mipmaps { MIPMAPS } else { 1 };
        let (vertices, textures) = (
            scene.mesh.vertices.len(),
            scene.textures.len() * self.mipmaps,
        );
        assert!(
            vertices <= MAX_VERTICES && textures <= MAX_TEXTURES,
            "the scene has {vertices} vertices and {textures} textures; the arenas hold {MAX_VERTICES} \
             and {MAX_TEXTURES}",
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
        for (texture, made) in scene
            .textures
            .iter()
            .zip(self.surfaces.chunks_mut(self.mipmaps))
        {
            let whole = Surface {
                first: 0,
                width: texture.width(),
                height: texture.height(),
                tile: texture.tile(),
            };
            for (mip, surface) in made.iter_mut().enumerate() {
                *surface = Surface {
                    first: free,
                    ..whole.halved(mip)
                };
                let len = surface.texels();
                let lit = self
                    .texels
                    .get_mut(free..free + len * LIGHT_LEVELS)
                    .expect("the scene's textures are larger than the surface arena");
                free += lit.len();
                let (columns, rows) = surface.sides();
                let pitch = usize::from(columns).next_power_of_two();
                let block = (whole.sides().0 / columns, whole.sides().1 / rows);
                for j in 0..rows {
                    for i in 0..columns {
                        let texel = match mip {
                            0 => texture.at(i32::from(i) << 16, i32::from(j) << 16),
                            _ => mean(texture, (i, j), block, scene.palette),
                        };
                        let place = usize::from(j) * pitch + usize::from(i);
                        let copies = lit.chunks_exact_mut(len);
                        for (copy, light) in copies.zip(scene.light) {
                            copy[place] = light[usize::from(texel)];
                        }
                    }
                }
            }
        }
        let periods = scene.textures.iter();
        self.half_period = periods
            .filter_map(|texture| motion::half_period(texture, scene.palette))
            .min();
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
        lit(&self.surfaces, self.texels, number)
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

    /// Has the next pictures drawn in lower quality where their motion hides it, until this is called
    /// again: `next` is the pose that comes a tick after the one that is drawn. Returns what was set
    /// before.
    pub fn lower_for(&mut self, next: Option<Pose>) -> Option<Pose> {
        core::mem::replace(&mut self.next, next)
    }

    /// Faces of the last picture that were drawn in lower quality.
    pub fn lowered(&self) -> u32 {
        self.lowered
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
        let quality = Quality::of(mapper, pose, self.next.as_ref());
        let mut lowered = 0;
        let mut renderer = Renderer::new(self.jobs, &surfaces, destination, mapper, order);
        polygons(
            &self.mesh,
            self.mipmaps,
            self.points,
            pose,
            |number, face| match face {
                None => renderer.drop_face(),
                Some(face) => {
                    let chosen = quality.mapper(&face);
                    lowered += u32::from(chosen != mapper);
                    renderer.set_mapper(chosen);
                    match self.mesh.convex {
                        true => renderer.face(&face),
                        false => renderer.seen_face(&face, visible, number),
                    }
                }
            },
        );
        let stats = renderer.finish();
        self.lowered = lowered;
        stats
    }

    /// Finds out which of the mesh's faces, of at most [`MAX_FACES`], is seen at each pixel.
    pub fn find_visible(&mut self, pose: &Pose) -> &Visible<MAX_FACES> {
        self.visible.clear();
        polygons(
            &self.mesh,
            self.mipmaps,
            self.points,
            pose,
            |number, face| {
                if let Some(face) = face {
                    // What is out of range here is so again for the mapper, which counts it.
                    let _ = self.visible.add(number, &face);
                }
            },
        );
        self.visible.finish();
        self.visible
    }

    /// Gives `sink` the faces that look at the viewer, in the mesh's order, each with its number
    /// there; nothing for a face that is dropped.
    pub fn polygons(&mut self, pose: &Pose, sink: impl FnMut(u16, Option<Face<'_>>)) {
        polygons(&self.mesh, self.mipmaps, self.points, pose, sink);
    }
}

/// A texture in the light of a face.
fn lit<'t>(
    surfaces: &[Surface; MAX_TEXTURES],
    texels: &'t [u8; SURFACE_BYTES],
    number: u16,
) -> Texture<'t> {
    let number = usize::from(number);
    surfaces[number / LIGHT_LEVELS].lit(number % LIGHT_LEVELS, texels)
}

/// The faces that look at the viewer, in the mesh's order, each with its number there.
fn polygons(
    mesh: &Mesh<'_>,
    mipmaps: usize,
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
        let polygon = &mut polygon[..sides];
        if looks_at_viewer(polygon) {
            let level = lit_level(orientation.turn(face.normal));
            let mip = match mipmaps {
                1 => 0,
                _ => mipmap(polygon, mipmaps),
            };
            for vertex in &mut *polygon {
                (vertex.u, vertex.v) = (vertex.u >> mip, vertex.v >> mip);
            }
            let surface = (usize::from(face.texture) * mipmaps + mip) * LIGHT_LEVELS + level;
            // Far from each other, so that of a face with many corners they are not on a line.
            let anchors = [0, corners.len() / 3, 2 * corners.len() / 3].map(|i| Anchor {
                position: points[usize::from(corners[i].vertex)].view(),
                u: corners[i].u >> mip,
                v: corners[i].v >> mip,
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

/// The colour that comes nearest to the mean of a block of `size` texels, the one in column and row
/// `place` of such blocks. It is one that light can move.
fn mean(texture: &Texture<'_>, place: (u16, u16), size: (u16, u16), palette: &Palette) -> u8 {
    let mut sum = [0; 3];
    for j in 0..size.1 {
        for i in 0..size.0 {
            let [column, row] =
                [place.0 * size.0 + i, place.1 * size.1 + j].map(|at| i32::from(at) << 16);
            let colour = palette[usize::from(texture.at(column, row))];
            for (sum, part) in sum.iter_mut().zip(colour) {
                *sum += i32::from(part);
            }
        }
    }
    // At most 2^16 texels of 2^6 each, with 4 fraction bits.
    let count = i32::from(size.0) * i32::from(size.1);
    let mean = sum.map(|sum| sum * 16 / count);
    let distance = |entry: &usize| -> i32 {
        let off = |k: usize| mean[k] - 16 * i32::from(palette[*entry][k]);
        (0..3).map(|k| off(k).pow(2)).sum()
    };
    MATERIALS.min_by_key(distance).unwrap_or(0) as u8
}

/// The mipmap, of so many, that a polygon takes: the one of which a pixel along the side that has
/// most texels to a pixel gets one, within the square root of two.
///
/// That is the direction which would show a moire pattern; across it the mipmap is smoother than it
/// had to be.
fn mipmap(polygon: &[Vertex], mipmaps: usize) -> usize {
    let mut mip = 0;
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        // 1/256 texel, below 2^17, and 1/256 pixel, below 2^25. Within a pixel nothing is to be seen.
        let square = |x: i32, y: i32| i64::from(x).pow(2) + i64::from(y).pow(2);
        let texels = square((b.u - a.u) >> 8, (b.v - a.v) >> 8);
        let pixels = square(b.x - a.x, b.y - a.y).max(1 << 16);
        while mip + 1 < mipmaps && i128::from(texels) > i128::from(pixels) << (2 * mip + 1) {
            mip += 1;
        }
    }
    mip
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
