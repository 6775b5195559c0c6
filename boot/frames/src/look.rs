//! The options that decide how frames are drawn: scene, mapper and order, chosen by name.

use std::ffi::OsStr;
use std::fmt::Display;
use std::sync::LazyLock;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use protocol::{Command, Setting, Word};
use scene::catalogue::{CATALOGUE, Entry};
use texmap::{Mapper, Order};

/// Scene, mapper and order. `None` leaves the choice to the demo.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct Look {
    /// Which scene to show [default: ball, or your own model]
    #[arg(long, global = true, value_name = "NAME")]
    pub scene: Option<Named<&'static str>>,
    /// The mapper, which finds the texel of each pixel.
    #[arg(long, global = true, value_name = "NAME", value_parser = Mappers,
        help = with_default("How textures are mapped", Mapper::default()))]
    pub mapper: Option<Mapper>,
    /// The order in which the columns of a frame are drawn, and the destination.
    #[arg(long, global = true, value_name = "NAME",
        help = with_default("In which order the columns of a frame are drawn, and where to", name_of(Order::default())))]
    pub order: Option<Named<Order>>,
}

/// Returns a help text with the default, in clap's notation.
fn with_default(help: &str, default: impl Display) -> String {
    format!("{help} [default: {default}]")
}

/// Returns an order's name on the command line.
fn name_of(order: Order) -> &'static str {
    let named = Order::ALL.into_iter().find(|(_, other, _)| *other == order);
    named.map_or("", |(name, ..)| name)
}

impl Look {
    /// Returns the commands that set these options; they follow [`Command::Hold`].
    pub fn commands(&self) -> impl Iterator<Item = Command> {
        let set = |setting, name: &dyn Display| Some(Command::Set(setting, Some(Word::of(name)?)));
        let scene = self.scene.and_then(|s| set(Setting::Scene, &s.0));
        let mapper = self.mapper.and_then(|m| set(Setting::Mapper, &m));
        let order = self.order.and_then(|o| set(Setting::Order, &o.0));
        scene.into_iter().chain(mapper).chain(order)
    }
}

/// A value that has a name on the command line.
#[derive(Clone, Copy, Debug)]
pub struct Named<T>(pub T);

/// Parses a mapper's name: a listed name, or a mapper within any tolerance.
#[derive(Clone)]
struct Mappers;

impl TypedValueParser for Mappers {
    type Value = Mapper;

    fn parse_ref(
        &self,
        command: &clap::Command,
        argument: Option<&clap::Arg>,
        value: &OsStr,
    ) -> Result<Mapper, clap::Error> {
        let names = PossibleValuesParser::new(Mapper::ALL.iter().map(|(name, ..)| *name));
        if let Some((old, new)) = value
            .to_str()
            .and_then(|old| Some((old, Mapper::renamed(old)?)))
        {
            system::say(format_args!(
                "--mapper {old}: this mapper is called '{new}' now; the next version does not accept '{old}'"
            ));
        }
        match value.to_str().and_then(Mapper::parse) {
            Some(mapper) => Ok(mapper),
            None => Err(names
                .parse_ref(command, argument, value)
                .expect_err("a listed name is a mapper's")),
        }
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue>>> {
        let named = Mapper::ALL.iter();
        Some(Box::new(named.map(|(name, _, about)| {
            PossibleValue::new(*name).help(*about)
        })))
    }
}

/// The names of all scenes; the user's own model is last.
static SCENES: LazyLock<Vec<Named<&'static str>>> = LazyLock::new(|| {
    let built_in = CATALOGUE.iter().map(|entry| entry.name);
    built_in.chain([Entry::LOADED]).map(Named).collect()
});

impl ValueEnum for Named<&'static str> {
    fn value_variants<'a>() -> &'a [Self] {
        &SCENES
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let about = Entry::parse(self.0).map_or("your own --model", |entry| entry.about);
        Some(PossibleValue::new(self.0).help(about))
    }
}

impl ValueEnum for Named<Order> {
    fn value_variants<'a>() -> &'a [Self] {
        &[
            Named(Order::Polygons),
            Named(Order::Planes),
            Named(Order::Buffer),
        ]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, _, about) = Order::ALL
            .into_iter()
            .find(|(_, order, _)| *order == self.0)?;
        Some(PossibleValue::new(name).help(about))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_a_value_and_a_word_on_the_line() {
        for &(name, mapper, _) in Mapper::ALL {
            assert_eq!(Mapper::parse(name), Some(mapper));
            assert_eq!(mapper.to_string(), name);
            assert!(Word::new(name).is_some(), "{name}");
        }
        for entry in &CATALOGUE {
            assert!(Word::new(entry.name).is_some(), "{}", entry.name);
        }
        assert_eq!(Named::<Order>::value_variants().len(), Order::ALL.len());
        for (named, (name, order, _)) in Named::<Order>::value_variants().iter().zip(Order::ALL) {
            assert_eq!(named.0, order);
            assert_eq!(Order::parse(name), Some(order));
        }
    }
}
