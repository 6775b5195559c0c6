//! Makes a model file from the user's model: a Wavefront OBJ and a PNG.
//!
//! ```
//! # fn main() -> anyhow::Result<()> {
//! let model = import::Model::new(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", None)?;
//! assert!(model.to_string().starts_with("3 vertices, 1 face, "));
//! assert_eq!(model::ModelFile::parse(&model.bytes)?.checksum(), model.file().checksum());
//! # Ok(())
//! # }
//! ```
//!
//! ```text
//! OBJ -> polygons on the grid -> layout of the texture -> mesh   \
//! PNG ------------------------> cut from the repeated image     > model file -> ramdisk, emulated VGA
//!                               -> texels, palette, light table  /
//! ```
//!
//! The importer does all of this once, in floating point where that is easier. The result consists of
//! integers (the crate [`model`] defines the format), and the same files give the same result.

pub mod colour;
mod file_kind;
mod guard;
pub mod layout;
pub mod mesh;
pub mod obj;
pub mod polygon;
pub mod texture;
mod vector;

use std::fmt;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, anyhow, bail};
use model::{ModelFile, Parts};
use scene::Mesh;
use scene::catalogue::{Colours, Entry, MAX_TEXELS};
use system::quote;
use texmap::Texture;

use colour::QuantizedTexture;
use layout::Layout;
use mesh::{Facing, ImportedMesh};
use obj::{BadLine, Obj};
use polygon::{FaceCounts, Polygons};
use texture::OpaqueImage;

/// The maximum size of an OBJ in bytes: far more than a model of [`scene::MAX_FACES`] faces has.
const MAX_BYTES: u64 = 64 << 20;
/// The time limit for making a model: far more than the largest model needs.
const MAX_TIME: Duration = Duration::from_secs(120);
/// The bytes of a ramdisk that the boot loader reads in a second from the disk that this program gives QEMU:
/// 16 MiB took 8.6 s longer than no ramdisk. From an IDE disk, the rate is a sixth of this.
const BYTES_A_SECOND: f64 = 2e6;
/// The scene whose texture a model without a texture gets. The lines of that texture show how it lies on the
/// model.
const PATTERN: &str = "tilted";

/// The files of a model.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct Files {
    /// Your own model: a Wavefront OBJ
    #[arg(long, global = true, value_name = "FILE.obj")]
    pub model: Option<PathBuf>,
    /// The model's texture: a PNG; transparent parts are blended with grey (808080) [default: a marble board]
    #[arg(long, global = true, value_name = "FILE.png")]
    pub texture: Option<PathBuf>,
}

impl Files {
    /// Makes the model file. Returns `None` if no model is given, even with a texture.
    ///
    /// # Errors
    /// If a file cannot be used. The message names the file, the line if one is at fault, and the reason.
    pub fn load(&self) -> anyhow::Result<Option<Model>> {
        match &self.model {
            Some(model) => Model::load(model, self.texture.as_deref()).map(Some),
            None => Ok(None),
        }
    }
}

/// A model in the form of a model file.
#[derive(Clone, PartialEq, Eq)]
pub struct Model {
    /// The model file's bytes.
    pub bytes: Vec<u8>,
    /// A summary of the import, for people.
    about: String,
}

impl fmt::Debug for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a model: {}", self.about)
    }
}

/// Writes the summary of the import.
impl fmt::Display for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.about)
    }
}

impl Model {
    /// Makes a model from an OBJ, and from a PNG as its texture. Without a PNG the model gets a pattern.
    ///
    /// # Errors
    /// As [`Files::load`]. [`Interrupted`](system::Interrupted) as soon as the user stops the program.
    pub fn load(obj: &Path, png: Option<&Path>) -> anyhow::Result<Self> {
        let (obj, png) = (obj.to_owned(), png.map(Path::to_owned));
        let name = quote::path(&obj);
        let work = move || Self::load_files(&obj, png.as_deref());
        guard::run(&name, MAX_TIME, work)
    }

    fn load_files(obj: &Path, png: Option<&Path>) -> anyhow::Result<Self> {
        let bytes = read_obj(obj).with_context(|| quote::path(obj))?;
        let image = match png {
            Some(png) => {
                let file = File::open(png).context("cannot be read");
                let image = file.and_then(|file| texture::read(BufReader::new(file)));
                Some(image.with_context(|| quote::path(png))?)
            }
            None => None,
        };
        Self::new(&bytes, image.as_ref()).map_err(|error| {
            let name = quote::path(obj);
            match error.downcast::<BadLine>() {
                Ok(BadLine { line, why }) => anyhow!("{name}:{line}: {why}"),
                Err(error) => error.context(name),
            }
        })
    }

    /// Makes a model from an OBJ's bytes and an image.
    ///
    /// # Errors
    /// As [`Files::load`], without the file's name.
    pub fn new(obj: &[u8], image: Option<&OpaqueImage>) -> anyhow::Result<Self> {
        let pixels = image.map(|image| &image.pixels);
        let size = obj.len();
        let other = |error| match file_kind::of(obj, Some(size)) {
            Some(kind) => anyhow!("the file is {kind}, not a Wavefront OBJ; {}", remedy(&kind)),
            None => error,
        };
        // An HTML page can contain the text of an OBJ.
        let text = obj.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(obj);
        if text.trim_ascii_start().starts_with(b"<") {
            return Err(other(anyhow!(
                "the file is not a Wavefront OBJ; pass an OBJ file"
            )));
        }
        let obj = obj::parse(obj).map_err(|error| other(error.into()))?;
        let pattern = Entry::parse(PATTERN).expect("the pattern's scene is in the catalogue");
        let mut painted = Box::new([0; MAX_TEXELS]);
        let painted = pattern.paint(&mut painted)[0];
        let pattern = pattern.scene(&[]);
        let (side_u, side_v) = (painted.width().into(), painted.height().into());
        let size = pixels.map_or((side_u, side_v), image::RgbImage::dimensions);
        let made = make_mesh(&obj, size);
        let (mesh, layout) = match made {
            Err(error) if obj.faces.is_empty() => return Err(other(error)),
            made => made?,
        };
        let quantized = pixels.map(|pixels| {
            let texels = layout.cut_scaled(pixels);
            colour::quantize(&texels, layout.size().0.into())
        });
        let (texels, colours) = match &quantized {
            Some(QuantizedTexture {
                texels,
                palette,
                light,
            }) => (texels.clone(), Colours { palette, light }),
            // The pattern's texels are entries of the palette, which cannot be averaged, so it is scaled by
            // leaving texels out.
            None => {
                let (width, height) = layout.scaled();
                let pixel = |i, j| {
                    let (i, j) = (i * side_u / width, j * side_v / height);
                    painted.texels()[(j * side_u + i) as usize]
                };
                (layout.cut(pixel), Colours::BUILT_IN)
            }
        };
        let (width, height) = layout.size();
        let parts = Parts {
            mesh: Mesh {
                vertices: &mesh.vertices,
                corners: &mesh.corners,
                faces: &mesh.faces,
                convex: false,
            },
            texture: Texture::new(&texels, width, height)?,
            colours,
            background: pattern.background,
        };
        let mut bytes = Vec::new();
        parts.write(|part| bytes.extend_from_slice(part));
        // The kernel would refuse a wrong model file only seconds later, after the boot.
        ModelFile::parse(&bytes).context(
            "the model file made from it is invalid: a bug of this program; please report it",
        )?;
        Ok(Self {
            about: about(&obj, &mesh, (width, height), image),
            bytes,
        })
    }

    /// Returns the model file.
    pub fn file(&self) -> ModelFile<'_> {
        ModelFile::parse(&self.bytes).expect("`new` has parsed the same bytes")
    }

    /// Returns how much longer the boot loader needs to read an image with this model, in seconds.
    pub fn boot_seconds(&self) -> f64 {
        self.bytes.len() as f64 / BYTES_A_SECOND
    }
}

/// Returns an OBJ's mesh, and the way to cut its texture from an image of `image` pixels.
///
/// # Errors
/// If no face can be drawn, if the mesh exceeds a limit of a model file, or if a face repeats the image too
/// often.
pub fn make_mesh(obj: &Obj, image: (u32, u32)) -> anyhow::Result<(ImportedMesh, Layout)> {
    let polygons = Polygons::new(obj)?;
    let layout = Layout::new(&polygons.polygons, image)?;
    Ok((ImportedMesh::new(polygons, &layout)?, layout))
}

/// Reads an OBJ's bytes.
fn read_obj(path: &Path) -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(MAX_BYTES + 1).read_to_end(&mut bytes))
        .context("cannot be read")?;
    if bytes.len() as u64 > MAX_BYTES {
        match file_kind::of(&bytes, None) {
            Some(kind) => bail!("the file is {kind}, not a Wavefront OBJ; {}", remedy(&kind)),
            None => bail!(
                "the file has more than {MAX_BYTES} bytes; {}",
                obj::SIMPLIFY
            ),
        }
    }
    Ok(bytes)
}

/// Returns what the user can do about a model of another format.
fn remedy(kind: &str) -> &'static str {
    match kind {
        "PNG" => "pass an image with --texture",
        kind if kind.ends_with("text") => "save it as UTF-8",
        kind if kind.contains("MTL") => "pass the OBJ file that uses this library",
        _ => "export the model as an OBJ",
    }
}

/// Returns the summary of the import: a line, and a note if the whole model faces the wrong way.
fn about(
    obj: &Obj,
    mesh: &ImportedMesh,
    (width, height): (u16, u16),
    image: Option<&OpaqueImage>,
) -> String {
    let FaceCounts {
        degenerate,
        cut,
        projected,
    } = mesh.counts;
    let faces = mesh.faces.len();
    let s = if faces == 1 { "" } else { "s" };
    let mut about = format!("{} vertices, {faces} face{s}", mesh.vertices.len());
    let of = obj.faces.len();
    for (count, what) in [
        (cut, "cut into triangles"),
        (degenerate, "skipped because they have no area"),
        (projected, "with generated texture coordinates"),
    ] {
        if count > 0 {
            about += &format!(", {count} of {of} faces {what}");
        }
    }
    if obj.skipped.count > 0 {
        about += &format!(", {}", obj.skipped);
    }
    let built_in = if image.is_some() { "" } else { "built-in " };
    about += &format!(", {built_in}texture {width} x {height}");
    if image.is_some_and(|image| image.transparent) {
        about += ", transparent parts blended with grey (808080)";
    }
    let facing = match mesh.facing() {
        Facing::Viewer => return about,
        Facing::Inward => "every face looks inward, so the model is inside out",
        Facing::Away => "every face looks away in the first frame",
    };
    about
        + &format!(
            "\nnote: {facing}. A face's front is the side from which its corners run \
             counter-clockwise. To turn the faces, reverse their corners (flip the normals) in the \
             program that made the model."
        )
}
