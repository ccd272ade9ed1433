//! Files of text that a person or a program wrote for this one.

use std::fmt;
use std::io;
use std::marker::PhantomData;
use std::path::Path;

use serde::de::value::SeqAccessDeserializer;
use serde::de::{
    Deserialize, DeserializeOwned, DeserializeSeed, Deserializer, Error as _, IgnoredAny, SeqAccess, Visitor,
};

use crate::error::{Error, ErrorKind};
use crate::files;

/// Most bytes of a configuration, a scene, a plan, a sweep or a list of prices.
///
/// Parsing takes up to 100 times as much memory.
const MOST_BYTES: u64 = 1 << 20;

/// Most bytes of a map of a tradeoff, whose lines take no more memory when they are parsed.
pub const MOST_MAP_BYTES: u64 = 16 << 20;

/// Returns the content of a configuration, a scene, a plan, a sweep or a list of prices.
///
/// # Errors
/// The file cannot be read, is no text, or is larger than 1 MB.
pub fn file_text(path: &Path) -> Result<String, Error> {
    file_text_of(path, MOST_BYTES)
}

/// Returns the content of a file of text that has at most this many bytes.
///
/// # Errors
/// The file cannot be read, is no text, or is larger.
pub fn file_text_of(path: &Path, most: u64) -> Result<String, Error> {
    text(path, files::content(path, most), most)
}

/// Returns the content of a configuration that is a file, and no pipe or device: reading it never waits.
///
/// # Errors
/// The file cannot be read, is no file or no text, or is larger than 1 MB.
pub(crate) fn stored_text(path: &Path) -> Result<String, Error> {
    text(path, files::file_content(path, MOST_BYTES), MOST_BYTES)
}

/// Returns the text of what was read of a file of at most this many bytes.
fn text(path: &Path, content: io::Result<Option<Vec<u8>>>, most: u64) -> Result<String, Error> {
    let Some(bytes) = content.map_err(|error| Error::io(path.display(), error))? else {
        let message = format_args!("is larger than {} MB, expected a file of text", most >> 20);
        return Err(Error::new(ErrorKind::Format, path.display(), message));
    };
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        Error::new(ErrorKind::Format, path.display(), format_args!("byte {at} is no text, expected UTF-8"))
            .caused_by(error)
    })
}

/// Reads a TOML text.
///
/// # Errors
/// The text is not of this type. The message is [`toml_error`].
pub fn from_toml<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    toml::from_str(text).map_err(|error| {
        // serde lists the names only for a wrong name, so one takes the value's place.
        let span = error.span().filter(|_| error.message() == NO_NAME).unwrap_or_default();
        let named = [&text[..span.start], "\"?\"", &text[span.end..]].concat();
        match toml::from_str::<T>(&named).err().filter(|of_name| of_name.message().starts_with(WRONG_NAME)) {
            Some(of_name) => {
                let found = text[span].lines().next().unwrap_or_default();
                let found = format!("found {}", crate::visible::shortened(found, 100));
                toml_error(text, &of_name).replacen("found ?", &found, 1)
            }
            None => toml_error(text, &error),
        }
    })
}

/// A list of TOML with a fixed number of values, an array or a tuple. The `toml` crate leaves out what stands behind
/// them.
struct Whole<T>(T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Whole<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct List<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for List<T> {
            type Value = T;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<T, A::Error> {
                let mut counted = Counted { list, taken: 0 };
                let value = T::deserialize(SeqAccessDeserializer::new(&mut counted))?;
                let expected = counted.taken;
                while counted.next_element::<IgnoredAny>()?.is_some() {}
                match counted.taken {
                    found if found == expected => Ok(value),
                    found => Err(A::Error::custom(format_args!("the list has {found} values, expected {expected}"))),
                }
            }
        }
        deserializer.deserialize_seq(List(PhantomData)).map(Self)
    }
}

/// A list, and how many of its values were taken.
struct Counted<A> {
    list: A,
    taken: usize,
}

impl<'de, A: SeqAccess<'de>> SeqAccess<'de> for Counted<A> {
    type Error = A::Error;

    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, A::Error> {
        let next = self.list.next_element_seed(seed)?;
        self.taken += usize::from(next.is_some());
        Ok(next)
    }
}

/// Reads a list with a fixed number of values, an array or a tuple.
///
/// # Errors
/// It is no list, or has another number of values. (The `toml` crate leaves out what stands behind them.)
pub fn whole<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<T, D::Error> {
    Whole::deserialize(deserializer).map(|Whole(value)| value)
}

/// Reads a list with a fixed number of values that may be missing, as [`whole`].
///
/// # Errors
/// It is no list, or has another number of values.
pub fn whole_if_any<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<Option<T>, D::Error> {
    whole(deserializer).map(Some)
}

/// Reads a list of lists, each as [`whole`].
///
/// # Errors
/// One of them has another number of values, or it is no list of lists.
pub fn wholes<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<Vec<T>, D::Error> {
    let wholes = Vec::<Whole<T>>::deserialize(deserializer)?;
    Ok(wholes.into_iter().map(|Whole(value)| value).collect())
}

/// Says in one line what is wrong with a TOML text, and where.
pub fn toml_error(text: &str, error: &toml::de::Error) -> String {
    let mut alone = error.clone();
    alone.set_input(None);
    // Without the text, the error names the key behind its message.
    let shown = alone.to_string();
    let path = shown.strip_prefix(error.message()).and_then(|path| path.split('`').nth(1));
    // The path of a key that is not known, or missing, is that of its table.
    let is_of_table = OF_TABLE.iter().any(|head| error.message().starts_with(head));
    let key = match path.map(|path| path.rsplit_once('.').filter(|_| !is_of_table).ok_or(path)) {
        None => String::new(),
        Some(Err(table)) if is_of_table => format!("[{table}] "),
        Some(Err(key)) => format!("{key}: "),
        Some(Ok((table, key))) => format!("[{table}] {key}: "),
    };
    let message = key + &in_words(&error.message().trim_end().replace('\n', ", "));
    let Some(before) = error.span().and_then(|span| text.get(..span.start)) else { return message };
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    let there = crate::visible::shortened(text.lines().nth(line - 1).unwrap_or_default().trim(), 100).into_owned();
    let there = if there.is_empty() { there } else { format!(" (in: {there})") };
    format!("TOML line {line}, column {column}: {message}{there}")
}

/// The message of the `toml` crate about a value in place of a name.
const NO_NAME: &str = "wanted string or table";
/// How serde's message about a wrong name begins, and those about a key that is not known or is missing.
const WRONG_NAME: &str = "unknown variant ";
const OF_TABLE: [&str; 2] = ["unknown field ", "missing field "];
/// The text of serde between found and expected, and behind a large number.
const BETWEEN: &str = ", expected ";
const LARGE: &str = " as i128";
/// How messages of serde, the values that it found and those that it expected begin, and the words for people who write
/// files.
const HEADS: &[(&str, &str)] = &[
    (WRONG_NAME, "found "),
    (OF_TABLE[0], "unknown key "),
    (OF_TABLE[1], "missing key "),
    ("invalid type: ", "found "),
    ("invalid value: ", "found "),
    ("invalid length ", "found a list of "),
];
const FOUND: &[(&str, &str)] = &[
    ("map", "a table"),
    ("sequence", "a list"),
    ("boolean ", ""),
    ("integer ", ""),
    ("floating point ", ""),
    ("string ", ""),
];
const EXPECTED: &[(&str, &str)] = &[
    ("u8", "a whole number from 0 to 255"),
    ("u16", "a whole number from 0 to 65535"),
    ("u32", "a whole number from 0 to 4294967295"),
    ("u64", "a whole number from 0 on"),
    ("usize", "a whole number from 0 on"),
    ("i64", "a whole number"),
    ("f32", "a number"),
    ("f64", "a number"),
    ("a boolean", "true or false"),
    ("a string", "a text in quotes"),
    ("a sequence", "a list (one of tables has [[ ]] around its name)"),
    ("a map", "a table"),
    ("an array of length ", "a list of "),
    ("a tuple of size ", "a list of "),
];

/// Returns a message of serde in words for people who write files; others as they are.
fn in_words(message: &str) -> String {
    let known = |text: &str, table: &[(&str, &str)]| {
        table.iter().find_map(|(from, to)| Some(format!("{to}{}", text.strip_prefix(from)?)))
    };
    let Some((head, rest)) = HEADS.iter().find_map(|(from, to)| Some((to, message.strip_prefix(from)?))) else {
        return message.to_owned();
    };
    let (found, expected) = rest.rsplit_once(BETWEEN).unwrap_or((rest, ""));
    let found = known(found, FOUND).unwrap_or(found.to_owned());
    let found = found.trim_end_matches(LARGE).trim_matches('`');
    match expected.split(' ').next() {
        Some("") | None => format!("{head}{found}"),
        Some("struct") => format!("{head}{found}, expected a table"),
        _ => format!("{head}{found}, expected {}", known(expected, EXPECTED).unwrap_or(expected.replace('`', "\""))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_with_toml_is_one_line() {
        for (text, says) in [
            ("a = 1\né = 1 x", "TOML line 2, column 1: "),
            ("[t]\n\"k\\u001b\\n\" = 1\n  = 2", "TOML line 3, column 3: "),
            ("a", "TOML line 1, column "),
        ] {
            let error = toml::from_str::<toml::Table>(text).unwrap_err();
            let said = toml_error(text, &error);
            assert!(said.starts_with(says) && !said.contains('\n') && said.contains(" (in: "), "{said}");
        }
    }

    #[test]
    fn a_list_has_neither_more_nor_fewer_values() {
        #[derive(Debug, Default, serde::Deserialize)]
        #[serde(rename_all = "lowercase")]
        enum Side {
            #[default]
            Left,
            Right,
        }
        #[derive(Debug, Default, serde::Deserialize)]
        #[serde(default)]
        struct Lists {
            #[serde(deserialize_with = "whole")]
            pair: [f64; 2],
            #[serde(deserialize_with = "whole_if_any")]
            size: Option<[u16; 2]>,
            side: Side,
            #[serde(deserialize_with = "wholes")]
            places: Vec<(i64, f64)>,
        }
        let lists: Lists = from_toml("pair = [1, 2.5]\nplaces = [[3, 4], [5, 0.5]]").unwrap();
        assert_eq!((lists.pair, lists.size, lists.places), ([1.0, 2.5], None, vec![(3, 4.0), (5, 0.5)]));
        for (text, says) in [
            ("pair = [1]", "found a list of 1, expected a list of 2"),
            ("pair = [1, 2, 3]", "the list has 3 values, expected 2 (in: pair = [1, 2, 3])"),
            ("size = [1, 2, 3]", "the list has 3 values, expected 2 (in: size = [1, 2, 3])"),
            ("places = [[1, 2], [3, 4, 5]]", "the list has 3 values, expected 2 (in: places = "),
            ("pair = 1", "pair: found 1, expected a list (in: pair = 1)"),
            ("side = 3", "side: found 3, expected \"left\" or \"right\" (in: side = 3)"),
            ("size = [1, \"a\"]", "size: found \"a\", expected a whole number from 0 to 65535"),
        ] {
            let error = from_toml::<Lists>(text).unwrap_err();
            assert!(error.contains(says) && error.starts_with("TOML line 1, column "), "{text}: {error}");
        }
    }

    #[test]
    fn text_is_read_and_what_is_none_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        std::fs::write(&path, "é").unwrap();
        assert_eq!(file_text(&path).unwrap(), "é");
        std::fs::write(&path, b"ab\xFF").unwrap();
        let error = file_text(&path).unwrap_err();
        assert!(error.kind() == ErrorKind::Format && error.message().contains("byte 2 is no text"), "{error}");
        assert_eq!(file_text(&folder.path().join("none")).unwrap_err().kind(), ErrorKind::NotFound);
        // A device that never ends takes no more memory than the largest file.
        let error = file_text(Path::new("/dev/zero")).unwrap_err();
        assert!(error.kind() == ErrorKind::Format && error.message().contains("larger than 1 MB"), "{error}");
    }
}
