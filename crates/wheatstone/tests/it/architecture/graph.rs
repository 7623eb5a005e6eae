//! Which file of a crate uses which, and the circles among them.

use super::source::{Import, Source};
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

/// A module's path within its crate; nothing for the crate itself.
type Module = Vec<String>;

/// The files of a crate, by the module that each of them is.
pub(crate) struct Crate {
    files: BTreeMap<Module, (String, Source)>,
}

/// Where a path leads.
enum Target {
    Module(Module),
    /// To an item that is defined in this module.
    Item(Module),
}

impl Target {
    fn module(self) -> Module {
        match self {
            Self::Module(module) | Self::Item(module) => module,
        }
    }
}

impl Crate {
    /// What is reached from `lib.rs`, or `main.rs`, by `mod` outside of tests.
    pub(crate) fn read(folder: &Path) -> Self {
        let mut read = Self { files: BTreeMap::new() };
        let source = folder.join("src");
        let root = ["lib.rs", "main.rs"].map(|name| source.join(name));
        let root = root.iter().find(|path| path.exists()).unwrap();
        read.take(&source, Vec::new(), root);
        read
    }

    fn take(&mut self, root: &Path, module: Module, file: &Path) {
        let source = Source::parse(&fs::read_to_string(file).unwrap());
        let folder = module.iter().fold(root.to_owned(), |folder, part| folder.join(part));
        let children = source.modules.clone();
        let name = file.strip_prefix(root).unwrap().display().to_string();
        self.files.insert(module.clone(), (name, source));
        for child in children {
            let places: [PathBuf; 2] =
                [folder.join(format!("{child}.rs")), folder.join(&child).join("mod.rs")];
            let file = places.iter().find(|path| path.exists());
            let file = file.unwrap_or_else(|| panic!("no file of {child} in {}", folder.display()));
            self.take(root, [module.as_slice(), &[child]].concat(), file);
        }
    }

    /// Modules right below the crate, in their order.
    pub(crate) fn layers(&self) -> &[String] {
        &self.files[&Vec::new()].1.modules
    }

    pub(crate) fn sources(&self) -> impl Iterator<Item = (&str, &Source)> {
        self.files.values().map(|(name, source)| (name.as_str(), source))
    }

    /// Where a path in a module leads, if to this crate. An item that is passed on is followed to where it is
    /// defined.
    fn resolve(&self, module: &Module, path: &[String], depth: usize) -> Option<Target> {
        let (first, rest) = path.split_first()?;
        let (from, rest) = match first.as_str() {
            "crate" => (Vec::new(), rest),
            "self" => (module.clone(), rest),
            "super" => (module[..module.len().checked_sub(1)?].to_vec(), rest),
            child if self.files[module].1.modules.iter().any(|m| m == child) => {
                (module.clone(), path)
            }
            local => {
                let import = self.import(module, local).filter(|import| import.path != path)?;
                let path = [&import.path, rest].concat();
                return (depth < 16).then(|| self.resolve(module, &path, depth + 1))?;
            }
        };
        self.descend(from, rest, depth)
    }

    fn descend(&self, from: Module, path: &[String], depth: usize) -> Option<Target> {
        let Some((next, rest)) = path.split_first() else { return Some(Target::Module(from)) };
        if next == "super" {
            return self.descend(from[..from.len().checked_sub(1)?].to_vec(), rest, depth);
        }
        let child = [from.as_slice(), std::slice::from_ref(next)].concat();
        if self.files.contains_key(&child) {
            return self.descend(child, rest, depth);
        }
        if let (Some(import), true) = (self.import(&from, next), depth < 16) {
            let path = [&import.path, rest].concat();
            // What comes from another crate is as good as defined here.
            return self.resolve(&from, &path, depth + 1).or(Some(Target::Item(from)));
        }
        Some(Target::Item(from))
    }

    fn import(&self, module: &Module, local: &str) -> Option<&Import> {
        self.files[module].1.imports.iter().find(|import| import.local == local)
    }

    /// The modules that each module uses.
    ///
    /// A module above another uses it where it imports one of its items for itself: rows of a registry and items that
    /// are only passed on are no use. A module below another uses it where the item is defined there.
    fn edges(&self) -> BTreeMap<&Module, BTreeSet<Module>> {
        self.files.iter().map(|(module, (_, source))| (module, self.used(module, source))).collect()
    }

    fn used(&self, module: &Module, source: &Source) -> BTreeSet<Module> {
        let mut used = BTreeSet::new();
        for import in &source.imports {
            let Some(target) = self.resolve(module, &import.path, 0) else { continue };
            let is_module = matches!(target, Target::Module(_));
            let target = target.module();
            let stands_above = module.starts_with(&target);
            let stands_below = target.starts_with(module);
            if !(stands_above && is_module || stands_below && (import.is_public || is_module)) {
                used.insert(target);
            }
        }
        for path in &source.paths {
            if let Some(Target::Item(target)) = self.resolve(module, path, 0)
                && !target.starts_with(module)
            {
                used.insert(target);
            }
        }
        used.remove(module);
        used
    }

    /// Uses of one module right below the crate by another, with the file.
    pub(crate) fn uses_of_layers(&self) -> Vec<(&str, String, String)> {
        let mut found = Vec::new();
        for (module, used) in self.edges() {
            for target in used {
                if let (Some(own), Some(other)) = (module.first(), target.first())
                    && own != other
                {
                    let file = self.files[module].0.as_str();
                    found.push((file, own.clone(), other.clone()));
                }
            }
        }
        found
    }

    /// Which of these files uses which.
    pub(crate) fn uses_among(&self, files: &[&str]) -> Vec<String> {
        let among = |module: &Module| files.contains(&self.files[module].0.as_str());
        let mut found = Vec::new();
        for (module, used) in self.edges().into_iter().filter(|(module, _)| among(module)) {
            for other in used.iter().filter(|other| among(other)) {
                found.push(format!("{} uses {}", self.files[module].0, self.files[other].0));
            }
        }
        found
    }

    /// The files of each circle, in the order of their names.
    pub(crate) fn circles(&self) -> Vec<Vec<&str>> {
        let edges = self.edges();
        let mut search = Search::new(&edges);
        for module in self.files.keys() {
            search.visit(module);
        }
        let named = |circle: &Vec<&Module>| {
            let mut names: Vec<&str> = circle.iter().map(|m| self.files[*m].0.as_str()).collect();
            names.sort_unstable();
            names
        };
        let mut circles: Vec<Vec<&str>> = search.circles.iter().map(named).collect();
        circles.sort();
        circles
    }
}

/// Tarjan's search for strongly connected components (1972, doi:10.1137/0201010).
struct Search<'a> {
    edges: &'a BTreeMap<&'a Module, BTreeSet<Module>>,
    /// The number of each module that was visited, and the lowest that it reaches.
    numbers: BTreeMap<&'a Module, (usize, usize)>,
    open: Vec<&'a Module>,
    circles: Vec<Vec<&'a Module>>,
}

impl<'a> Search<'a> {
    fn new(edges: &'a BTreeMap<&'a Module, BTreeSet<Module>>) -> Self {
        Self { edges, numbers: BTreeMap::new(), open: Vec::new(), circles: Vec::new() }
    }

    /// The lowest number that a module reaches.
    fn visit(&mut self, module: &'a Module) -> usize {
        if let Some((_, lowest)) = self.numbers.get(module) {
            return *lowest;
        }
        let number = self.numbers.len();
        self.numbers.insert(module, (number, number));
        self.open.push(module);
        let mut lowest = number;
        for next in &self.edges[module] {
            match self.numbers.get(next) {
                None => lowest = lowest.min(self.visit(next)),
                Some((other, _)) if self.open.contains(&next) => lowest = lowest.min(*other),
                Some(_) => {}
            }
        }
        self.numbers.insert(module, (number, lowest));
        if lowest == number {
            let start = self.open.iter().position(|other| *other == module).unwrap();
            let circle = self.open.split_off(start);
            if circle.len() > 1 {
                self.circles.push(circle);
            }
        }
        lowest
    }
}
