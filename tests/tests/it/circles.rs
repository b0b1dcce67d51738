//! Inside a crate, too, things rest on each other in one direction: no two modules use one another, be it through others.
//!
//! A module is a file. It uses what its `use` declarations and paths lead to, re-exports followed to where a thing is
//! said; unit tests do not count, and what stands inside macros or reaches methods of a type is not seen. What encloses a module is its surroundings, which it may use.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use syn::{Attribute, Item, ItemMod, ItemUse, UseTree, Visibility, visit::Visit};

use crate::architecture;

/// The names that lead to a module or a thing, from the root of its crate.
type Names = Vec<String>;

/// What a file says about others.
#[derive(Default)]
struct Module {
    /// Paths as they are written.
    uses: Vec<Names>,
    /// Where the things lead that it hands on, by the name it hands them on by; `*` for all of a module.
    handed_on: Vec<(String, Names)>,
}

impl<'ast> Visit<'ast> for Module {
    fn visit_item(&mut self, item: &'ast Item) {
        let attributes = match item {
            Item::Mod(item) => &item.attrs,
            Item::Fn(item) => &item.attrs,
            Item::Impl(item) => &item.attrs,
            Item::Use(item) => &item.attrs,
            _ => &Vec::new(),
        };
        if !attributes.iter().any(is_test) {
            syn::visit::visit_item(self, item);
        }
    }

    /// What stands inside a file, such as generated code, is a part of it.
    fn visit_item_mod(&mut self, _: &'ast ItemMod) {}

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        for names in flatten(&item.tree) {
            match item.vis {
                Visibility::Inherited => self.uses.push(names),
                _ => self.handed_on.push((names[names.len() - 1].clone(), names)),
            }
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.uses.push(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        syn::visit::visit_path(self, path);
    }
}

/// Whether it is `#[cfg(test)]`.
fn is_test(attribute: &Attribute) -> bool {
    attribute.path().is_ident("cfg") && attribute.parse_args::<syn::Ident>().is_ok_and(|name| name == "test")
}

/// Every path of a `use` declaration.
fn flatten(tree: &UseTree) -> Vec<Names> {
    let below =
        |name: String, rest: Vec<Names>| rest.into_iter().map(|rest| [vec![name.clone()], rest].concat()).collect();
    match tree {
        UseTree::Path(path) => below(path.ident.to_string(), flatten(&path.tree)),
        UseTree::Group(group) => group.items.iter().flat_map(flatten).collect(),
        UseTree::Name(name) => vec![vec![name.ident.to_string()]],
        UseTree::Rename(name) => vec![vec![name.ident.to_string()]],
        UseTree::Glob(_) => vec![vec!["*".to_owned()]],
    }
}

/// The modules of a crate, by their paths.
struct Modules(BTreeMap<Names, Module>);

impl Modules {
    fn of(source: &Path) -> Self {
        let mut modules = BTreeMap::new();
        let mut folders = vec![(source.to_owned(), Vec::new())];
        while let Some((folder, path)) = folders.pop() {
            for entry in fs::read_dir(folder).expect("a folder of the house") {
                let entry = entry.expect("an entry").path();
                let name = entry.file_stem().and_then(|name| name.to_str()).expect("a plain name").to_owned();
                let below = [path.clone(), vec![name.clone()]].concat();
                if entry.is_dir() {
                    folders.push((entry, below));
                } else if entry.extension().is_some_and(|extension| extension == "rs") {
                    let itself = if ["lib", "main", "mod"].contains(&name.as_str()) { path.clone() } else { below };
                    let text = fs::read_to_string(&entry).expect("a text");
                    let file = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", entry.display()));
                    let module: &mut Module = modules.entry(itself).or_default();
                    module.visit_file(&file);
                }
            }
        }
        Self(modules)
    }

    /// What a path leads to that is written in `module`, from the root of the crate; `None` if it leads out of the crate.
    fn absolute(&self, module: &[String], path: &[String]) -> Option<Names> {
        let ups = path.iter().take_while(|name| *name == "super").count();
        let start = match path.first()?.as_str() {
            "crate" => return Some(path[1..].to_vec()),
            "self" => return Some([module, &path[1..]].concat()),
            "super" => &module[..module.len().checked_sub(ups)?],
            child if self.0.contains_key(&[module, &[child.to_owned()]].concat()) => module,
            _ => return None,
        };
        Some([start, &path[ups..]].concat())
    }

    /// The module in which the thing of a name is said.
    fn home(&self, name: &[String]) -> Names {
        let known = (0..=name.len()).rev().find(|&length| self.0.contains_key(&name[..length]));
        let (module, rest) = name.split_at(known.expect("every crate has a root"));
        let Some(thing) = rest.first() else { return module.to_vec() };
        let handed_on = |by: &str| self.0[module].handed_on.iter().find(|(name, _)| name == by);
        match handed_on(thing).or_else(|| handed_on("*")).and_then(|(_, path)| self.absolute(module, path)) {
            Some(path) => self.home(path.strip_suffix(&["*".to_owned()]).unwrap_or(&path)),
            None => module.to_vec(),
        }
    }

    /// What each module uses, beyond what encloses it.
    fn used(&self) -> BTreeMap<&Names, BTreeSet<Names>> {
        let of = |(path, module): (&Names, &Module)| {
            let homes = module.uses.iter().filter_map(|names| Some(self.home(&self.absolute(path, names)?)));
            homes.filter(|home| !path.starts_with(home)).collect()
        };
        self.0.iter().map(|(path, module)| (path, of((path, module)))).collect()
    }

    /// The modules that use themselves through others.
    fn circles(&self) -> Vec<String> {
        let used = self.used();
        let reached = |from: &Names| {
            let (mut open, mut reached) = (vec![from.clone()], BTreeSet::new());
            while let Some(module) = open.pop() {
                open.extend(used[&module].iter().filter(|next| reached.insert((*next).clone())).cloned());
            }
            reached
        };
        used.keys().filter(|module| reached(module).contains(**module)).map(|module| module.join("::")).collect()
    }
}

#[test]
fn modules_that_use_one_another_through_what_is_handed_on_are_found() {
    let source = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| fs::write(source.path().join(name), text).unwrap();
    file("lib.rs", "mod a; mod b; mod c; pub use b::B;");
    file("a.rs", "use crate::B; pub struct A(B);");
    file("b.rs", "pub struct B; impl B { pub fn a() -> crate::a::A { crate::a::A(B) } }");
    file("c.rs", "#[cfg(test)] mod tests { use super::C; use crate::a::A; } pub struct C(crate::a::A);");
    assert_eq!(Modules::of(source.path()).circles(), ["a", "b"]);
}

#[test]
fn no_modules_of_a_crate_use_one_another_in_a_circle() {
    let circles: Vec<_> = architecture::folders()
        .into_iter()
        .flat_map(|folder| {
            Modules::of(&folder.join("src")).circles().into_iter().map(move |module| (folder.clone(), module))
        })
        .map(|(folder, module)| format!("{}: {module}", folder.file_name().unwrap_or_default().display()))
        .collect();
    assert!(circles.is_empty(), "modules in circles:\n{}", circles.join("\n"));
}
