//! How pictures are drawn: what a user may choose of it, by name.

use std::sync::LazyLock;

use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use link::{Command, Setting, Word};
use scene::catalogue::{CATALOGUE, Entry};
use texmap::{Mapper, Order};

/// Scene, mapper and order; what is not chosen is as the program has it.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct Look {
    /// What is shown
    #[arg(long, global = true, value_name = "NAME")]
    pub scene: Option<Named<&'static Entry>>,
    /// How textures are mapped
    #[arg(long, global = true, value_name = "NAME")]
    pub mapper: Option<Named<Mapper>>,
    /// In which order the columns of a picture are drawn, and where to
    #[arg(long, global = true, value_name = "NAME")]
    pub order: Option<Named<Order>>,
}

impl Look {
    /// The commands that set it, after [`Command::Hold`].
    pub fn commands(&self) -> impl Iterator<Item = Command> {
        let set = |setting, name| Some(Command::Set(setting, Some(Word::new(name)?)));
        let scene = self.scene.and_then(|s| set(Setting::Scene, s.0.name));
        let mapper = self.mapper.and_then(|m| set(Setting::Mapper, m.0.name()));
        let order = self.order.and_then(|o| set(Setting::Order, o.0.name()));
        scene.into_iter().chain(mapper).chain(order)
    }
}

/// Something that has a name on the command line.
#[derive(Clone, Copy, Debug)]
pub struct Named<T>(pub T);

/// All mappers, for clap's list.
static MAPPERS: [Named<Mapper>; Mapper::ALL.len()] = {
    let mut all = [Named(Mapper::Exact); Mapper::ALL.len()];
    let mut i = 0;
    while i < all.len() {
        all[i] = Named(Mapper::ALL[i].1);
        i += 1;
    }
    all
};

impl ValueEnum for Named<Mapper> {
    fn value_variants<'a>() -> &'a [Self] {
        &MAPPERS
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, _, about) = Mapper::ALL
            .iter()
            .find(|(_, mapper, _)| *mapper == self.0)?;
        Some(PossibleValue::new(name).help(about))
    }
}

/// All scenes.
static SCENES: LazyLock<Vec<Named<&'static Entry>>> =
    LazyLock::new(|| CATALOGUE.iter().map(Named).collect());

impl ValueEnum for Named<&'static Entry> {
    fn value_variants<'a>() -> &'a [Self] {
        &SCENES
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.0.name).help(self.0.about))
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
        let mappers = Named::<Mapper>::value_variants();
        assert_eq!(mappers.len(), Mapper::ALL.len());
        for (named, &(name, mapper, _)) in mappers.iter().zip(Mapper::ALL) {
            assert_eq!(named.0, mapper);
            let value = named.to_possible_value().unwrap();
            assert_eq!(value.get_name(), name);
            assert_eq!(Mapper::parse(name), Some(mapper));
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
