//! Rust source as tokens, without comments, texts and tests; and the paths in it.

/// A piece of source: a name, or one character.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Token {
    Name(String),
    Mark(char),
}

impl Token {
    pub(crate) fn is(&self, text: &str) -> bool {
        match self {
            Self::Name(name) => name == text,
            Self::Mark(mark) => text.chars().eq([*mark]),
        }
    }

    pub(crate) fn name(&self) -> Option<&str> {
        if let Self::Name(name) = self { Some(name) } else { None }
    }
}

/// One name that a `use` brings, or passes on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Import {
    pub(crate) path: Vec<String>,
    /// What it is called here; `*` for all there is.
    pub(crate) local: String,
    pub(crate) is_public: bool,
}

/// What one file says.
#[derive(Debug, Default)]
pub(crate) struct Source {
    pub(crate) tokens: Vec<Token>,
    pub(crate) modules: Vec<String>,
    pub(crate) imports: Vec<Import>,
    /// Paths of two names or more outside of `use`.
    pub(crate) paths: Vec<Vec<String>>,
    /// Names that stand alone outside of `use`.
    pub(crate) names: Vec<String>,
}

impl Source {
    pub(crate) fn parse(text: &str) -> Self {
        let mut source =
            Self { tokens: without_tests(&tokens(&without_texts(text))), ..Self::default() };
        let tokens = std::mem::take(&mut source.tokens);
        let mut at = 0;
        while at < tokens.len() {
            let starts = at == 0 || !tokens[at - 1].is(".");
            if tokens[at].is("use") {
                let end = (at..tokens.len()).find(|i| tokens[*i].is(";")).unwrap();
                let is_public =
                    at > 0 && (tokens[at - 1].is("pub") || is_restricted(&tokens, at - 1));
                tree(&tokens[at + 1..end], &[], is_public, &mut source.imports);
                at = end;
            } else if tokens[at].is("mod") && tokens.get(at + 2).is_some_and(|t| t.is(";")) {
                source.modules.extend(tokens[at + 1].name().map(str::to_owned));
                at += 2;
            } else if let (true, Some(first)) = (starts, tokens[at].name()) {
                let mut path = vec![first.to_owned()];
                while let [colon, second, next, ..] = &tokens[at + 1..]
                    && colon.is(":")
                    && second.is(":")
                    && let Some(next) = next.name()
                {
                    path.push(next.to_owned());
                    at += 3;
                }
                if path.len() > 1 { source.paths.push(path) } else { source.names.extend(path) }
            }
            at += 1;
        }
        source.tokens = tokens;
        source
    }
}

/// Whether the `)` at a place ends a `pub(…)`.
fn is_restricted(tokens: &[Token], end: usize) -> bool {
    tokens[end].is(")")
        && (0..end)
            .rev()
            .find(|i| tokens[*i].is("("))
            .is_some_and(|open| open > 0 && tokens[open - 1].is("pub"))
}

/// The imports of what stands between `use` and `;`.
fn tree(tokens: &[Token], above: &[String], is_public: bool, found: &mut Vec<Import>) {
    let mut path = above.to_vec();
    let mut local = None;
    let mut at = 0;
    while at < tokens.len() {
        if tokens[at].is("{") {
            let mut depth = 0;
            let mut start = at + 1;
            for (i, token) in tokens.iter().enumerate().skip(at) {
                depth += i32::from(token.is("{")) - i32::from(token.is("}"));
                if depth == 0 || (depth == 1 && token.is(",")) {
                    if i > start {
                        tree(&tokens[start..i], &path, is_public, found);
                    }
                    start = i + 1;
                }
            }
            return;
        }
        match &tokens[at] {
            Token::Name(name) if name == "as" => {
                local = tokens[at + 1].name().map(str::to_owned);
                at += 1;
            }
            Token::Name(name) if name == "self" && !above.is_empty() => {}
            Token::Name(name) => path.push(name.clone()),
            Token::Mark('*') => path.push("*".into()),
            Token::Mark(_) => {}
        }
        at += 1;
    }
    let Some(last) = path.last() else { return };
    let local = local.unwrap_or_else(|| last.clone());
    found.push(Import { path, local, is_public });
}

/// Source with comments left out and texts and characters emptied.
fn without_texts(text: &str) -> String {
    let text: Vec<char> = text.chars().collect();
    let mut code = String::new();
    let mut at = 0;
    let starts =
        |at: usize, what: &str| text[at..].iter().take(what.len()).copied().eq(what.chars());
    while at < text.len() {
        let in_name = at > 0 && (text[at - 1].is_alphanumeric() || text[at - 1] == '_');
        let hashes = text[at..].iter().skip(1).take_while(|c| **c == '#').count();
        if starts(at, "//") {
            at = (at..text.len()).find(|i| text[*i] == '\n').unwrap_or(text.len());
        } else if starts(at, "/*") {
            at = (at + 2..text.len()).find(|i| starts(*i, "*/")).unwrap_or(text.len()) + 2;
        } else if text[at] == 'r' && !in_name && text.get(at + 1 + hashes) == Some(&'"') {
            let end = format!("\"{}", "#".repeat(hashes));
            let open = at + 2 + hashes;
            at = (open..text.len()).find(|i| starts(*i, &end)).unwrap() + end.len();
        } else if text[at] == '"' {
            at += 1;
            while text[at] != '"' {
                at += 1 + usize::from(text[at] == '\\');
            }
            at += 1;
        } else if text[at] == '\''
            && (text.get(at + 1) == Some(&'\\') || text.get(at + 2) == Some(&'\''))
        {
            at = (at + 2..text.len()).find(|i| text[*i] == '\'' && *i > at + 1).unwrap();
            at += 1 + usize::from(text.get(at + 1) == Some(&'\''));
        } else {
            code.push(text[at]);
            at += 1;
        }
    }
    code
}

fn tokens(code: &str) -> Vec<Token> {
    let mut found = Vec::new();
    let mut name = String::new();
    for c in code.chars().chain([' ']) {
        if c.is_alphanumeric() || c == '_' {
            name.push(c);
            continue;
        }
        if !name.is_empty() {
            found.push(Token::Name(std::mem::take(&mut name)));
        }
        if !c.is_whitespace() {
            found.push(Token::Mark(c));
        }
    }
    found
}

/// Without what stands under `#[cfg(test)]` and the like.
fn without_tests(tokens: &[Token]) -> Vec<Token> {
    let mut kept = Vec::new();
    let mut at = 0;
    let marks = ["#", "[", "cfg", "(", "test", ")", "]"];
    while at < tokens.len() {
        let is_test = tokens.len() - at >= marks.len()
            && marks.iter().zip(&tokens[at..]).all(|(mark, token)| token.is(mark));
        if !is_test {
            kept.push(tokens[at].clone());
            at += 1;
            continue;
        }
        // The item that it is about ends with its body, or a semicolon.
        let mut depth = 0;
        at += marks.len();
        while at < tokens.len() {
            depth += i32::from(tokens[at].is("{")) - i32::from(tokens[at].is("}"));
            let ends = depth == 0 && (tokens[at].is("}") || tokens[at].is(";"));
            at += 1;
            if ends {
                break;
            }
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uses_and_paths_are_read_and_texts_and_tests_are_not() {
        let source = Source::parse(
            r#"
            //! crate::comment::It
            mod child;
            pub(crate) use child::Kept;
            use super::{Method, fit::{self, stage::{joint, Prior as P}}};
            /* crate::other::It */
            fn f<'a>(x: &'a str) -> crate::geometry::Pixel {
                let c = ['"', '\'', 'x'];
                let t = "crate::text::It \" self::no";
                child::made(x).into_iter::<P>()
            }
            #[cfg(test)]
            mod tests { use crate::wrong::It; fn g() { crate::bad::f() } }
            const AFTER: u8 = joint::MOST;
            "#,
        );
        assert_eq!(source.modules, ["child"]);
        let imports: Vec<String> = source
            .imports
            .iter()
            .map(|i| {
                format!("{}{} {}", i.path.join("::"), if i.is_public { "!" } else { "" }, i.local)
            })
            .collect();
        assert_eq!(
            imports,
            [
                "child::Kept! Kept",
                "super::Method Method",
                "super::fit fit",
                "super::fit::stage::joint joint",
                "super::fit::stage::Prior P",
            ]
        );
        let paths: Vec<String> = source.paths.iter().map(|path| path.join("::")).collect();
        assert_eq!(paths, ["crate::geometry::Pixel", "child::made", "joint::MOST"]);
    }
}
