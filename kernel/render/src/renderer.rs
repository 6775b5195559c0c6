//! The scene renderer: prepares a scene's textures, and turns a pose into polygons.

use modex::{Destination, HEIGHT, Palette};
use texmap::plane::Anchor;
use texmap::{Face, JobList, MAX_SIDES, Mapper, Order, Renderer, Stats, Texture, Vertex, Visible};

use scene::clip::{ViewPoint, place};
use scene::{
    FOCAL_LENGTH, LIGHT_LEVELS, MATERIALS, MAX_CORNERS, MAX_EXTENT, MAX_FACES, MAX_VERTICES, Mesh,
    Pose, Scene, lit_level,
};

use crate::motion::{self, MapperChoice};

/// Most jobs that are collected before they are drawn.
pub const MAX_JOBS: usize = 4096;
/// Room for a scene's textures, padded, with a copy for each light level: one texture of the largest size.
pub const SURFACE_BYTES: usize = 3 << 19;
/// Most textures of a scene. Each mipmap counts as a texture.
const MAX_TEXTURES: usize = 16;
/// Mipmaps of a texture: the texture itself, and copies down to 1/64 of its sides.
const MIPMAPS: usize = 7;

/// How a frame is drawn. The default is the default mapper and order, in full quality.
#[derive(Clone, Copy, Debug, Default)]
pub struct RenderOptions {
    /// The mapper in full quality.
    pub mapper: Mapper,
    /// The order in which the spans are drawn.
    pub order: Order,
    /// The pose one tick after the drawn pose. A face whose motion to this pose hides a mapper's errors is drawn
    /// in reduced quality, by a faster mapper. `None` draws every face in full quality.
    pub next: Option<Pose>,
}

/// Counts of a drawn frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drawn {
    /// Polygons, spans and pixels, drawn and dropped.
    pub stats: Stats,
    /// Faces that were drawn in reduced quality.
    pub reduced: u32,
}

/// Fixed arenas for drawing.
#[derive(Clone, Copy, Debug)]
pub struct RenderMemory {
    surfaces: [u8; SURFACE_BYTES],
    points: [ViewPoint; MAX_VERTICES],
    visible: Visible<MAX_FACES>,
    jobs: JobList<MAX_JOBS>,
}

impl RenderMemory {
    /// Empty arenas, about 3 MiB: intended for a static.
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

/// The place of a texture's lit copies: one copy for each light level, one after the other.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Surface {
    first: usize,
    width: u16,
    height: u16,
    /// Columns and rows of the tile, if the texture is tiled.
    tile: Option<(u16, u16)>,
}

impl Surface {
    /// The copy for a light level.
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

    /// Texels of one copy, padding included.
    fn texels(&self) -> usize {
        let (width, height) = self.sides();
        Texture::padded_len(width, height)
    }

    /// Texels that are stored across and down: the tile's, or the texture's.
    fn sides(&self) -> (u16, u16) {
        self.tile.unwrap_or((self.width, self.height))
    }

    /// The texture with each side halved `times` times; a side is at least one texel.
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
/// Light in the mapper would cost a second look-up for every pixel. A face has one light level, so
/// [`SceneRenderer::set`] runs each texture through the light table once per level, and a face uses the copy for its
/// level. The mapper's loop needs no light.
#[derive(Debug)]
pub struct SceneRenderer<'a> {
    name: &'static str,
    pub(crate) mesh: Mesh<'a>,
    palette: &'a Palette,
    background: &'a [u8; HEIGHT],
    /// Mipmaps of each texture of the scene.
    pub(crate) mipmaps: usize,
    /// Half the shortest period of the textures, 16.16 texels.
    pub(crate) half_period: Option<u32>,
    pub(crate) surfaces: [Surface; MAX_TEXTURES],
    pub(crate) texels: &'a mut [u8; SURFACE_BYTES],
    pub(crate) points: &'a mut [ViewPoint; MAX_VERTICES],
    pub(crate) visible: &'a mut Visible<MAX_FACES>,
    jobs: &'a mut JobList<MAX_JOBS>,
}

impl<'a> SceneRenderer<'a> {
    /// Lights the textures of `scene` into `storage`.
    ///
    /// # Panics
    /// As [`SceneRenderer::set`].
    pub fn new(storage: &'a mut RenderMemory, scene: Scene<'a, '_>) -> Self {
        let RenderMemory {
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

    /// Replaces the scene, and lights its textures.
    ///
    /// # Panics
    /// If the scene is larger than the arenas: more than [`MAX_VERTICES`] vertices; for a mesh that is not
    /// convex, more than [`MAX_FACES`] faces; more than 16 textures, each mipmap counted; or textures of more
    /// than [`SURFACE_BYTES`] / [`LIGHT_LEVELS`] texels together, each padded to powers of two. If a face has
    /// fewer than 3 or more than [`MAX_CORNERS`] corners, or a vertex is further out than [`MAX_EXTENT`].
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

    /// The colour of each scan line where no solid covers it.
    pub fn background(&self) -> &'a [u8; HEIGHT] {
        self.background
    }

    /// The lit texture with the number in a polygon's [`Face`].
    pub fn surface(&self, number: u16) -> Texture<'_> {
        lit(&self.surfaces, self.texels, number)
    }

    /// Draws the solid in `pose` on a destination that contains the background.
    ///
    /// At a distance outside 0 to [`Pose::MAX_DISTANCE`] every face is dropped. At other distances a face is
    /// dropped only if clipping leaves it too many corners.
    pub fn draw(
        &mut self,
        pose: &Pose,
        options: RenderOptions,
        destination: &mut impl Destination,
    ) -> Drawn {
        if !self.mesh.convex {
            self.find_visible(pose);
        }
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
        let RenderOptions { mapper, order, .. } = options;
        let choice = MapperChoice::new(&options, pose);
        let mut reduced = 0;
        let mut renderer = Renderer::new(self.jobs, &surfaces, destination, mapper, order);
        polygons(
            &self.mesh,
            self.mipmaps,
            self.points,
            pose,
            |number, face| match face {
                None => renderer.drop_face(),
                Some(face) => {
                    let chosen = choice.mapper(&face);
                    reduced += u32::from(chosen != mapper);
                    renderer.set_mapper(chosen);
                    match self.mesh.convex {
                        true => renderer.face(&face),
                        false => renderer.seen_face(&face, visible, number),
                    }
                }
            },
        );
        Drawn {
            stats: renderer.finish(),
            reduced,
        }
    }

    /// Finds the visible face at each pixel, for a mesh of at most [`MAX_FACES`] faces.
    pub fn find_visible(&mut self, pose: &Pose) -> &Visible<MAX_FACES> {
        self.visible.clear();
        polygons(
            &self.mesh,
            self.mipmaps,
            self.points,
            pose,
            |number, face| {
                if let Some(face) = face {
                    // A face out of range is out of range for the mapper too, which counts it.
                    let _ = self.visible.add(number, &face);
                }
            },
        );
        self.visible.finish();
        self.visible
    }

    /// Passes the front faces to `sink` in the mesh's order, each with its number in the mesh. `sink`
    /// receives `None` for a dropped face.
    pub fn polygons(&mut self, pose: &Pose, sink: impl FnMut(u16, Option<Face<'_>>)) {
        polygons(&self.mesh, self.mipmaps, self.points, pose, sink);
    }
}

/// A texture in the light of a face.
pub(crate) fn lit<'t>(
    surfaces: &[Surface; MAX_TEXTURES],
    texels: &'t [u8; SURFACE_BYTES],
    number: u16,
) -> Texture<'t> {
    let number = usize::from(number);
    surfaces[number / LIGHT_LEVELS].lit(number % LIGHT_LEVELS, texels)
}

/// Passes the front faces to `sink` in the mesh's order, each with its number in the mesh.
pub(crate) fn polygons(
    mesh: &Mesh<'_>,
    mipmaps: usize,
    points: &mut [ViewPoint; MAX_VERTICES],
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
        *point = ViewPoint::new([x, y, z + pose.distance]);
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
            // A third of the corners apart, so that the anchors of a face with many corners do not lie on a
            // line.
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

/// The colour nearest to the mean of a block of `size` texels. `place` is the block's column and row, counted
/// in blocks. The result is a material's colour, which light can change.
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

/// The mipmap, of `mipmaps`, that a polygon uses. Along the side with the most texels to a pixel, a pixel
/// covers one texel of that mipmap, within a factor of the square root of two.
///
/// The direction of that side would show a moire pattern; across it the mipmap is smoother than necessary.
fn mipmap(polygon: &[Vertex], mipmaps: usize) -> usize {
    let mut mip = 0;
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        // In 1/256 texel, below 2^17, and 1/256 pixel, below 2^25. A side shorter than a pixel counts as one
        // pixel: no detail is visible there.
        let square = |x: i32, y: i32| i64::from(x).pow(2) + i64::from(y).pow(2);
        let texels = square((b.u - a.u) >> 8, (b.v - a.v) >> 8);
        let pixels = square(b.x - a.x, b.y - a.y).max(1 << 16);
        while mip + 1 < mipmaps && i128::from(texels) > i128::from(pixels) << (2 * mip + 1) {
            mip += 1;
        }
    }
    mip
}

/// Whether the snapped polygon is wound clockwise on the screen (y down): a front face.
///
/// The snapped area decides, not the normal: the snapped polygon is what is drawn, and snapping may turn over
/// a face that is seen edge-on. A face that clipping removed has no area.
fn looks_at_viewer(polygon: &[Vertex]) -> bool {
    let mut area = 0i64;
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        area += i64::from(a.x) * i64::from(b.y) - i64::from(b.x) * i64::from(a.y);
    }
    area > 0
}
