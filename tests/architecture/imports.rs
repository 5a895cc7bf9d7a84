//! Which file of `src/` takes names from which other, followed through what modules hand on.

use crate::{code, files, inside};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A module by its path from the root of the crate: `["mhp", "tiles", "strip"]`.
pub(crate) type Module = Vec<String>;

/// What a name in a module stands for.
type Names = BTreeMap<String, Module>;

/// The files of `src/` and the paths that each of them uses.
pub(crate) struct Sources {
    files: BTreeMap<Module, PathBuf>,
    /// Paths as written, in `use` and in the code, and the name under which each is known.
    used: BTreeMap<Module, Vec<(String, Module)>>,
}

impl Sources {
    pub(crate) fn read() -> Self {
        let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let mut files_of = BTreeMap::new();
        for path in files(&src) {
            let inner = inside(&path).with_extension("");
            let mut module: Module = inner.iter().map(|part| part.to_str().unwrap().to_owned()).collect();
            if module.last().is_some_and(|last| last == "mod") || module == ["lib"] {
                module.pop();
            }
            // The program's root hands the engine's rooms on; the engine's own root adds nothing to it.
            if module != ["main"] && path != src.join("engine/lib.rs") {
                files_of.insert(module, path);
            }
        }
        let used =
            files_of.iter().map(|(module, path)| (module.clone(), paths_in(&code_of_the_program(path)))).collect();
        Self { files: files_of, used }
    }

    /// The file of a module, from `src/` on.
    pub(crate) fn shown(&self, module: &Module) -> String {
        inside(&self.files[module]).to_str().unwrap().replace('\\', "/")
    }

    /// Each file with those from which it takes names.
    pub(crate) fn graph(&self) -> BTreeMap<Module, BTreeSet<Module>> {
        let names: BTreeMap<&Module, Names> =
            self.used.iter().map(|(module, used)| (module, self.names(module, used))).collect();
        let of_file = |(module, used): (&Module, &Vec<(String, Module)>)| {
            let targets = used.iter().filter_map(|(_, path)| self.target(module, path, &names, 0));
            (module.clone(), targets.filter(|target| target != module).collect())
        };
        self.used.iter().map(of_file).collect()
    }

    fn names(&self, module: &Module, used: &[(String, Module)]) -> Names {
        used.iter().filter_map(|(name, path)| Some((name.clone(), self.absolute(module, path)?))).collect()
    }

    /// A path from the root of the crate; `None` where it leads out of it.
    fn absolute(&self, module: &Module, path: &[String]) -> Option<Module> {
        let (mut at, mut rest) = (module.clone(), path);
        match path.first()?.as_str() {
            "crate" => (at, rest) = (Module::new(), &path[1..]),
            "self" => rest = &path[1..],
            "super" => {
                while rest.first().is_some_and(|part| part == "super") {
                    at.pop()?;
                    rest = &rest[1..];
                }
            }
            first => {
                let child = [module.as_slice(), &[first.to_owned()]].concat();
                self.files.get(&child)?;
            }
        }
        at.extend(rest.iter().cloned());
        Some(at)
    }

    /// The module in whose file that which `path` names is written.
    fn target(
        &self,
        module: &Module,
        path: &[String],
        names: &BTreeMap<&Module, Names>,
        depth: usize,
    ) -> Option<Module> {
        let absolute = self.absolute(module, path)?;
        let mut at = Module::new();
        for part in &absolute {
            let child = [at.as_slice(), std::slice::from_ref(part)].concat();
            if self.files.contains_key(&child) {
                at = child;
                continue;
            }
            // A name that the module hands on is written elsewhere.
            let handed_on =
                names.get(&at).and_then(|names| names.get(part)).filter(|path| **path != absolute && depth < 8);
            if let Some(path) = handed_on {
                let from_root: Module = std::iter::once("crate".to_owned()).chain(path.iter().cloned()).collect();
                return self.target(&Module::new(), &from_root, names, depth + 1);
            }
            break;
        }
        Some(at)
    }
}

/// The code of a file without its own tests.
fn code_of_the_program(path: &Path) -> String {
    let code = code(path);
    code.split("\nmod tests {").next().unwrap_or_default().to_owned()
}

/// Every path in `use` items, and every one in the code that begins with `crate::` or `super::`, with the name it is known by.
fn paths_in(code: &str) -> Vec<(String, Module)> {
    let mut found = Vec::new();
    let part_of = |c: char| c.is_alphanumeric() || c == '_';
    for (at, _) in code.match_indices("use ") {
        if code[..at].chars().next_back().is_some_and(part_of) {
            continue;
        }
        if let Some((tree, _)) = code[at + 4..].split_once(';') {
            expand(&[], tree.trim(), &mut found);
        }
    }
    for start in ["crate::", "super::"] {
        for (at, _) in code.match_indices(start) {
            let before = code[..at].chars().next_back();
            if before.is_some_and(|c| part_of(c) || c == ':') {
                continue;
            }
            let path: String = code[at..].chars().take_while(|&c| part_of(c) || c == ':').collect();
            // The head of a group in `use`, or the reach of a `pub(in crate::…)`.
            if path.ends_with(':') || code[..at].ends_with("(in ") {
                continue;
            }
            let path: Module = path.split("::").filter(|part| !part.is_empty()).map(str::to_owned).collect();
            found.push((String::new(), path));
        }
    }
    found
}

/// The paths of a tree of `use`: `a::{b, c::d as e}` is `a::b` and `a::c::d`, known as `e`.
fn expand(before: &[String], tree: &str, found: &mut Vec<(String, Module)>) {
    let tree = tree.trim();
    if let Some((path, group)) = tree.split_once('{') {
        let path: Module = before.iter().cloned().chain(parts(path)).collect();
        let inner = group.trim_end().strip_suffix('}').unwrap_or(group);
        let (mut depth, mut start) = (0, 0);
        for (at, c) in inner.char_indices().chain([(inner.len(), ',')]) {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    expand(&path, &inner[start..at], found);
                    start = (at + 1).min(inner.len());
                }
                _ => {}
            }
        }
    } else if !tree.is_empty() {
        let (path, alias) = tree.split_once(" as ").map_or((tree, None), |(path, alias)| (path, Some(alias.trim())));
        let mut path: Module = before.iter().cloned().chain(parts(path)).collect();
        if path.last().is_some_and(|last| last == "self" || last == "*") && path.len() > 1 {
            path.pop();
        }
        let name = alias.or(path.last().map(String::as_str)).unwrap_or_default().to_owned();
        found.push((name, path));
    }
}

fn parts(path: &str) -> impl Iterator<Item = String> {
    path.split("::").map(str::trim).filter(|part| !part.is_empty()).map(str::to_owned)
}

#[test]
fn names_are_followed_to_where_they_are_written() {
    let mut found = Vec::new();
    expand(&[], "super::{em::{self, EmTarget as Target}, Problem, tiles::*}", &mut found);
    let shown: Vec<String> = found.iter().map(|(name, path)| format!("{name} = {}", path.join("::"))).collect();
    assert_eq!(
        shown,
        ["em = super::em", "Target = super::em::EmTarget", "Problem = super::Problem", "tiles = super::tiles"]
    );
    let graph = Sources::read().graph();
    let module = |path: &str| -> Module { path.split('/').map(str::to_owned).collect() };
    let fitter = &graph[&module("mhp/fitter")];
    for file in ["mhp/adam", "mhp/problem", "mhp/objective", "mhp/types", "body/pppr", "config"] {
        assert!(fitter.contains(&module(file)), "{file} is not among {fitter:?}");
    }
    assert!(!fitter.contains(&module("mhp")), "what `mhp` hands on is followed further");
}
