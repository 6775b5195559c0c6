//! The options that determine how frames are drawn: scene, mapper and order, each chosen by name.

use std::ffi::OsStr;
use std::fmt::Display;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use protocol::{Command, Setting, Word};
use scene::catalogue::{CATALOGUE, Entry};
use texmap::{Mapper, Order};

/// Scene, mapper and order. `None` leaves the choice to the demo.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct FrameOptions {
    /// The scene to show [default: ball, or your own model]
    #[arg(long, global = true, value_name = "NAME", value_parser = scenes())]
    pub scene: Option<&'static str>,
    /// The mapper, which finds the texel of each pixel.
    #[arg(long, global = true, value_name = "NAME", value_parser = Mappers,
        help = with_default("The mapper, which finds the texel of each pixel", Mapper::default()))]
    pub mapper: Option<Mapper>,
    /// The order in which the columns of a frame are drawn, and the destination.
    #[arg(long, global = true, value_name = "NAME", value_parser = orders(),
        help = with_default("The order in which the columns of a frame are drawn", Order::default()))]
    pub order: Option<Order>,
}

/// Returns a help text with the default, in clap's notation.
fn with_default(help: &str, default: impl Display) -> String {
    format!("{help} [default: {default}]")
}

impl FrameOptions {
    /// Returns the commands that set these options; they follow [`Command::Hold`].
    pub fn commands(&self) -> impl Iterator<Item = Command> {
        let set = |setting, name: &dyn Display| Some(Command::Set(setting, Some(Word::of(name)?)));
        let scene = self.scene.and_then(|scene| set(Setting::Scene, &scene));
        let mapper = self.mapper.and_then(|mapper| set(Setting::Mapper, &mapper));
        let order = self.order.and_then(|order| set(Setting::Order, &order));
        scene.into_iter().chain(mapper).chain(order)
    }
}

/// Returns the name of a built-in scene, or of the user's own model.
pub(crate) fn scene_named(name: &str) -> Option<&'static str> {
    let built_in = CATALOGUE.iter().map(|entry| entry.name);
    built_in.chain([Entry::LOADED]).find(|known| *known == name)
}

/// Returns a parser of scenes' names; the user's own model is last.
fn scenes() -> impl TypedValueParser<Value = &'static str> {
    let built_in = CATALOGUE.iter().map(|entry| (entry.name, entry.about));
    let all = built_in.chain([(Entry::LOADED, "your own model, from --model")]);
    PossibleValuesParser::new(all.map(|(name, about)| PossibleValue::new(name).help(about)))
        .map(|name| scene_named(&name).expect("the parser accepts listed names only"))
}

/// Returns a parser of orders' names.
fn orders() -> impl TypedValueParser<Value = Order> {
    let all = Order::ALL.map(|(name, _, about)| PossibleValue::new(name).help(about));
    PossibleValuesParser::new(all)
        .map(|name| Order::parse(&name).expect("the parser accepts listed names only"))
}

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
                "--mapper {old}: this mapper is now called '{new}'; the next version will not accept '{old}'"
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_parsed_and_is_a_word_of_the_protocol() {
        for &(name, mapper, _) in Mapper::ALL {
            assert_eq!(Mapper::parse(name), Some(mapper));
            assert_eq!(mapper.to_string(), name);
            assert!(Word::new(name).is_some(), "{name}");
        }
        for name in CATALOGUE.iter().map(|entry| entry.name) {
            assert_eq!(scene_named(name), Some(name));
            assert!(Word::new(name).is_some(), "{name}");
        }
        for (name, order, _) in Order::ALL {
            assert_eq!(Order::parse(name), Some(order));
            assert_eq!(order.to_string(), name);
            assert!(Word::new(name).is_some(), "{name}");
        }
    }
}
