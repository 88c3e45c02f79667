//! Finds for each file of the workspace the files of the same crate from which it imports: by `use`, by `pub use`, or by a
//! path in the code to a parent, a child or a sibling. Follows a name through re-exports to the file that declares it. Ignores
//! imports between crates, because cargo rejects cyclic dependencies of crates.

use proc_macro2::{TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use syn::visit::{self, Visit};

/// A module: its file, its declarations and the paths in it.
#[derive(Default)]
struct Module {
    file: PathBuf,
    parent: Option<usize>,
    children: BTreeMap<String, usize>,
    declared: BTreeSet<String>,
    /// Names that `use` imports, with their paths.
    used: BTreeMap<String, Vec<String>>,
    /// Paths from which `use path::*` imports all names.
    globs: Vec<Vec<String>>,
    /// Every path in the code.
    paths: BTreeSet<Vec<String>>,
}

/// The modules of one target, the root first.
pub struct Modules {
    all: Vec<Module>,
    /// Macros with `#[macro_export]`, whose paths begin at the root, and their files.
    exported: BTreeMap<String, PathBuf>,
}

/// Item that a path resolves to.
enum Named {
    Module(usize),
    Item,
}

impl Modules {
    /// Reads a target from its root file.
    pub fn read(root: &Path) -> Modules {
        let mut modules = Modules {
            all: Vec::new(),
            exported: BTreeMap::new(),
        };
        let folder = root.parent().expect("a folder");
        modules.add_file(root, folder, None);
        modules
    }

    /// Returns for each file the other files from which it imports.
    pub fn imports(&self) -> BTreeMap<PathBuf, BTreeSet<PathBuf>> {
        let mut imports = BTreeMap::<PathBuf, BTreeSet<PathBuf>>::new();
        for (at, module) in self.all.iter().enumerate() {
            let of_file = imports.entry(module.file.clone()).or_default();
            let globs = module.globs.iter().cloned();
            for path in module.paths.iter().cloned().chain(globs) {
                self.resolve(at, &path, of_file, &mut Search::default());
            }
            of_file.remove(&module.file);
        }
        imports
    }

    fn add_file(&mut self, file: &Path, folder: &Path, parent: Option<usize>) -> usize {
        let text = std::fs::read_to_string(file)
            .unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let parsed =
            syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        self.add_items(&parsed.items, file, folder, parent)
    }

    /// Adds a module of these items; files of its children are in `folder`.
    fn add_items(
        &mut self,
        items: &[syn::Item],
        file: &Path,
        folder: &Path,
        parent: Option<usize>,
    ) -> usize {
        let at = self.all.len();
        self.all.push(Module {
            file: file.to_owned(),
            parent,
            ..Module::default()
        });
        for item in items {
            if let syn::Item::Mod(child) = item {
                let name = child.ident.to_string();
                let inner = folder.join(&name);
                let paths = paths_of(&child.attrs);
                let added = match &child.content {
                    Some((_, items)) => self.add_items(items, file, &inner, Some(at)),
                    None if paths.is_empty() => {
                        let flat = folder.join(format!("{name}.rs"));
                        let nested = inner.join("mod.rs");
                        let file = if flat.exists() { flat } else { nested };
                        self.add_file(&file, &inner, Some(at))
                    }
                    None => {
                        let own = file.parent().expect("a folder");
                        let mut added = paths.iter().map(|path| {
                            let file = own.join(path).canonicalize().expect("a file");
                            let folder = file.parent().expect("a folder").to_owned();
                            self.add_file(&file, &folder, Some(at))
                        });
                        let first = added.next().expect("a path");
                        added.for_each(drop);
                        first
                    }
                };
                self.all[at].children.insert(name, added);
                continue;
            }
            if let syn::Item::Macro(item) = item
                && let Some(name) = &item.ident
                && item.attrs.iter().any(|a| a.path().is_ident("macro_export"))
            {
                self.exported.insert(name.to_string(), file.to_owned());
            }
            let mut reader = Reader {
                module: &mut self.all[at],
            };
            reader.declare(item);
            reader.visit_item(item);
        }
        at
    }

    /// Resolves a path in a module and adds the files on the way to `files`; `None` if the path is not in the crate.
    fn resolve(
        &self,
        from: usize,
        path: &[String],
        files: &mut BTreeSet<PathBuf>,
        search: &mut Search,
    ) -> Option<Named> {
        let mut at = from;
        for (index, name) in path.iter().enumerate() {
            let first = index == 0;
            let module = &self.all[at];
            match name.as_str() {
                "crate" if first => at = 0,
                "self" => {}
                "super" => at = module.parent?,
                name => {
                    if let Some(child) = module.children.get(name) {
                        at = *child;
                        continue;
                    }
                    if let Some(file) = self.exported.get(name).filter(|_| at == 0) {
                        files.insert(file.clone());
                        return Some(Named::Item);
                    }
                    if module.declared.contains(name) {
                        files.insert(module.file.clone());
                        return Some(Named::Item);
                    }
                    if let Some(used) = module.used.get(name).filter(|used| path != *used) {
                        search.depth += 1;
                        assert!(search.depth < 256, "{path:?} refers to itself");
                        match self.resolve(at, used, files, search)? {
                            Named::Module(found) => at = found,
                            Named::Item => return Some(Named::Item),
                        }
                        continue;
                    }
                    match self.through_globs(at, name, files, search) {
                        Some(Named::Module(found)) => {
                            at = found;
                            continue;
                        }
                        Some(Named::Item) => return Some(Named::Item),
                        None => {}
                    }
                    // The name is of another crate or of the language, unless a macro of that module declares it.
                    if !first {
                        files.insert(module.file.clone());
                    }
                    return None;
                }
            }
        }
        files.insert(self.all[at].file.clone());
        Some(Named::Module(at))
    }

    /// Resolves a name that a module has only by `use path::*`; adds the file that declares it to `files`.
    fn through_globs(
        &self,
        at: usize,
        name: &str,
        files: &mut BTreeSet<PathBuf>,
        search: &mut Search,
    ) -> Option<Named> {
        if !search.begun.insert((at, name.to_owned())) {
            return None;
        }
        self.all[at].globs.iter().find_map(|glob| {
            let of_glob = self.resolve(at, glob, &mut BTreeSet::new(), search);
            let Some(Named::Module(module)) = of_glob else {
                return None;
            };
            let mut found = BTreeSet::new();
            let named = self.resolve(module, &[name.to_owned()], &mut found, search)?;
            if matches!(named, Named::Item) {
                files.append(&mut found);
            }
            Some(named)
        })
    }
}

/// State of the resolution of a name.
#[derive(Default)]
struct Search {
    /// Modules and names whose resolution through globs has begun, so that modules that glob each other cause no endless loop.
    begun: BTreeSet<(usize, String)>,
    /// Number of re-exports followed.
    depth: usize,
}

/// Returns the values of `#[path = ".."]` and of `#[cfg_attr(.., path = "..")]`.
fn paths_of(attributes: &[syn::Attribute]) -> Vec<String> {
    let mut paths = Vec::new();
    for attribute in attributes {
        match &attribute.meta {
            syn::Meta::NameValue(pair) if pair.path.is_ident("path") => {
                if let syn::Expr::Lit(syn::ExprLit {
                    lit: syn::Lit::Str(path),
                    ..
                }) = &pair.value
                {
                    paths.push(path.value());
                }
            }
            syn::Meta::List(list) if list.path.is_ident("cfg_attr") => {
                let tokens = list.tokens.clone().into_iter();
                let tokens: Vec<String> = tokens.map(|token| token.to_string()).collect();
                let named = tokens
                    .windows(3)
                    .filter(|at| at[0] == "path" && at[1] == "=");
                paths.extend(named.map(|at| at[2].trim_matches('"').to_owned()));
            }
            _ => {}
        }
    }
    paths
}

/// Collects the declarations and paths in the items of a module.
struct Reader<'a> {
    module: &'a mut Module,
}

impl Reader<'_> {
    fn declare(&mut self, item: &syn::Item) {
        let name = match item {
            syn::Item::Const(item) => &item.ident,
            syn::Item::Enum(item) => &item.ident,
            syn::Item::Fn(item) => &item.sig.ident,
            syn::Item::Static(item) => &item.ident,
            syn::Item::Struct(item) => &item.ident,
            syn::Item::Trait(item) => &item.ident,
            syn::Item::Type(item) => &item.ident,
            syn::Item::Macro(syn::ItemMacro {
                ident: Some(name), ..
            }) => name,
            _ => return,
        };
        self.module.declared.insert(name.to_string());
    }

    fn tree(&mut self, tree: &syn::UseTree, before: &[String]) {
        let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        match tree {
            syn::UseTree::Path(path) => self.tree(&path.tree, &with(&path.ident)),
            syn::UseTree::Group(group) => {
                for tree in &group.items {
                    self.tree(tree, before);
                }
            }
            syn::UseTree::Glob(_) => self.module.globs.push(before.to_vec()),
            syn::UseTree::Name(name) if name.ident == "self" => {
                let last = before.last().expect("a module").clone();
                self.add_use(last, before.to_vec());
            }
            syn::UseTree::Name(name) => self.add_use(name.ident.to_string(), with(&name.ident)),
            syn::UseTree::Rename(rename) => {
                let path = match rename.ident == "self" {
                    true => before.to_vec(),
                    false => with(&rename.ident),
                };
                self.add_use(rename.rename.to_string(), path);
            }
        }
    }

    fn add_use(&mut self, name: String, path: Vec<String>) {
        self.module.paths.insert(path.clone());
        self.module.used.insert(name, path);
    }

    /// Finds the paths in a macro's tokens: names joined by `::`.
    fn tokens(&mut self, tokens: TokenStream) {
        let mut path = Vec::<String>::new();
        let mut colons = 0;
        for token in tokens {
            match token {
                TokenTree::Group(group) => {
                    self.end_path(&mut path);
                    self.tokens(group.stream());
                }
                TokenTree::Ident(name) => {
                    if colons != 2 {
                        self.end_path(&mut path);
                    }
                    path.push(name.to_string());
                }
                TokenTree::Punct(mark) if mark.as_char() == ':' => {
                    colons += 1;
                    continue;
                }
                _ => self.end_path(&mut path),
            }
            colons = 0;
        }
        self.end_path(&mut path);
    }

    fn end_path(&mut self, path: &mut Vec<String>) {
        if path.len() > 1 {
            self.module.paths.insert(core::mem::take(path));
        }
        path.clear();
    }
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        if item.leading_colon.is_none() {
            self.tree(&item.tree, &[]);
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names = path.segments.iter().map(|part| part.ident.to_string());
        let names: Vec<String> = names.collect();
        if names.len() > 1 && path.leading_colon.is_none() {
            self.module.paths.insert(names);
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, item: &'ast syn::Macro) {
        self.tokens(item.tokens.clone());
        visit::visit_macro(self, item);
    }

    fn visit_meta_list(&mut self, list: &'ast syn::MetaList) {
        self.tokens(list.tokens.clone());
    }

    /// `pub(super)` imports nothing.
    fn visit_vis_restricted(&mut self, _: &'ast syn::VisRestricted) {}
}

/// Returns for each file of a Python package the files from which it imports: `from supple._log import Log`, `from supple import
/// _native`, `from . import ..`.
pub fn python_imports(package: &Path) -> BTreeMap<PathBuf, BTreeSet<PathBuf>> {
    let name = package.file_name().expect("a name").to_string_lossy();
    let file_of = |module: &str| {
        let file = package.join(format!("{module}.py"));
        file.exists().then_some(file)
    };
    let mut imports = BTreeMap::new();
    for entry in std::fs::read_dir(package).expect("a package").flatten() {
        let path = entry.path();
        if path.extension().is_none_or(|end| end != "py") {
            continue;
        }
        let text = std::fs::read_to_string(&path).expect("readable");
        let mut found = BTreeSet::new();
        for line in text.lines().map(str::trim_start) {
            let Some((from, names)) = line
                .strip_prefix("from ")
                .and_then(|rest| rest.split_once(" import "))
            else {
                let module = line.strip_prefix("import ").unwrap_or_default();
                let module = module.strip_prefix(&format!("{name}.")).unwrap_or_default();
                found.extend(file_of(module.split([' ', '.']).next().unwrap_or_default()));
                continue;
            };
            let inner = from.strip_prefix(&*name).unwrap_or(from);
            match inner.strip_prefix('.') {
                Some(module) if !module.is_empty() => found.extend(file_of(module)),
                // An import from the package itself is of a module or of a name in `__init__.py`.
                _ if from == name || from == "." => {
                    let names = names.split([',', '(', ')']).map(str::trim);
                    let names = names.filter(|name| !name.is_empty() && *name != "_native");
                    found.extend(
                        names.filter_map(|name| file_of(name).or_else(|| file_of("__init__"))),
                    );
                }
                _ => {}
            }
        }
        found.remove(&path);
        imports.insert(path, found);
    }
    imports
}

#[cfg(test)]
mod tests {
    use super::Modules;
    use std::collections::BTreeSet;

    /// Creates a target of `a.rs`, `b/mod.rs` and `b/c.rs`; returns the files from which each imports.
    fn imports(a: &str, b: &str, c: &str) -> [BTreeSet<String>; 3] {
        let folder = tempfile::tempdir().expect("a folder");
        let root = folder.path();
        std::fs::create_dir(root.join("b")).expect("a folder");
        for (name, text) in [
            ("lib.rs", "mod a; mod b; pub use b::Thing;"),
            ("a.rs", a),
            ("b/mod.rs", b),
            ("b/c.rs", c),
        ] {
            std::fs::write(root.join(name), text).expect("written");
        }
        let imports = Modules::read(&root.join("lib.rs")).imports();
        ["a.rs", "b/mod.rs", "b/c.rs"].map(|name| {
            let of_file = imports[&root.join(name)].iter();
            let inner = of_file.map(|file| file.strip_prefix(root).expect("inside").display());
            inner.map(|file| file.to_string()).collect()
        })
    }

    fn set(names: &[&str]) -> BTreeSet<String> {
        names.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn a_name_is_followed_through_re_exports() {
        let [a, b, c] = imports(
            "use crate::Thing; pub struct A;",
            "mod c; pub use c::Thing;",
            "pub struct Thing(crate::a::A);",
        );
        assert_eq!(a, set(&["b/c.rs"]));
        assert_eq!(b, set(&["b/c.rs"]));
        assert_eq!(c, set(&["a.rs"]));
    }

    #[test]
    fn imports_from_parents_by_path_and_in_macros_are_found() {
        let [a, b, c] = imports(
            "fn f() { println!(\"{}\", crate::b::c::LIMIT) } macro_rules! m { () => { super::b::one() } }",
            "pub mod c; pub use c::Thing; pub fn one() {}",
            "pub struct Thing; pub const LIMIT: u8 = 1; fn f() { super::one() }",
        );
        assert_eq!(a, set(&["b/c.rs", "b/mod.rs"]));
        assert_eq!(b, set(&["b/c.rs"]));
        assert_eq!(c, set(&["b/mod.rs"]));
    }
    #[test]
    fn a_name_is_followed_through_globs() {
        // The name comes through `pub use x::*`, an intermediate `use x::*`, and a module that is also imported by a glob.
        let [a, b, c] = imports(
            "use crate::b::{Thing, LIMIT}; fn f() { crate::b::inner::Deep; }",
            "mod c; pub use c::*;",
            "pub struct Thing(crate::a::A); pub const LIMIT: u8 = 1; pub mod inner { pub struct Deep; }",
        );
        assert_eq!(a, set(&["b/c.rs"]));
        assert_eq!(b, set(&["b/c.rs"]));
        assert_eq!(c, set(&["a.rs"]));
    }

    #[test]
    fn modules_that_glob_each_other_are_resolved() {
        // The names are one that neither module has, one of the language, and one of the parent.
        let [a, b, c] = imports(
            "pub fn one() {}",
            "mod c; pub use c::*; use crate::a::*; pub struct Parent; fn f() { one() }",
            "use super::*; fn f(x: Vec::<u8>) { Missing::new(); Parent::new(); String::new(); super::one::<u8>() }",
        );
        assert_eq!(a, set(&[]));
        assert_eq!(b, set(&["a.rs", "b/c.rs"]));
        assert_eq!(c, set(&["a.rs", "b/mod.rs"]));
    }
}
