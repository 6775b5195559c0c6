//! The mappers: this folder decides the texture coordinates of each span of a face.
//!
//! A mapper passes mapped spans to a sink: a span of pixels with a stepper. It knows neither the
//! order of drawing nor what lies behind a span. Each approximation states its error bound against
//! [`exact`].

pub mod adaptive;
pub mod affine;
pub(crate) mod clamped;
pub mod constant_z;
pub(crate) mod coordinates;
pub mod exact;
pub mod free_direction;
pub mod linear;
pub(crate) mod mapped_span;
pub(crate) mod mapper;
pub mod pieces;
pub mod quadratic;
pub mod tiles;
pub mod within;

pub(crate) use mapped_span::MappedSpan;
pub use mapped_span::SpanKind;
pub use mapper::Mapper;
