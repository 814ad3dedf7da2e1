//! TOML text to typed values with places; the only importer of the `toml` crate.
//!
//! The tree is walked by hand, not deserialised, so that one mistake does not hide the next: each reading method
//! records what is wrong and returns `None`, and [`Table::finish`] records the keys that nobody asked for.

use std::ops::Range;

use glam::DVec3;
use toml::de::{DeArray, DeTable, DeValue};

use super::desc::{Rows4, Spanned};
use super::nearest::nearest;
use super::report::Report;
use super::validate::NumberRule;
use crate::error::{Place, Problem};

type Value<'t> = toml::Spanned<DeValue<'t>>;

/// Parses a text and walks it: syntax errors go to the report, what could be read to `read`.
pub fn walk<T>(text: &str, report: &Report, read: impl FnOnce(Table<'_>) -> T) -> T {
    let (root, errors) = DeTable::parse_recoverable(text);
    let mut errors: Vec<_> = errors.iter().map(|error| (error.span().unwrap_or(0..0), error.message())).collect();
    errors.sort_by_key(|(span, _)| span.start);
    for (span, message) in errors {
        report.syntax_error(span, message);
    }
    read(Table { entries: root.get_ref(), span: root.span(), path: String::new(), asked: Vec::new(), report })
}

/// A table of the file; keys are asked for by name and type.
pub struct Table<'t> {
    entries: &'t DeTable<'t>,
    /// The bytes of the table's header, or of the braces of an inline table.
    pub span: Range<usize>,
    /// The dotted key of the table; empty for the file itself.
    pub path: String,
    asked: Vec<&'static str>,
    report: &'t Report,
}

impl<'t> Table<'t> {
    /// Whether the table has a key, of whatever type. Does not count as asking.
    pub fn has(&self, key: &str) -> bool {
        self.entries.contains_key(key)
    }

    /// The dotted form of a key of this table.
    pub fn path_of(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    /// The bytes of a key's value; those of the table when it has no such key.
    pub fn span_of(&self, key: &str) -> Range<usize> {
        self.entries.get(key).map_or_else(|| self.span.clone(), toml::Spanned::span)
    }

    /// Records a mistake about a key of this table.
    pub fn mistake(&self, key: &str, problem: Problem) {
        self.report.mistake(&self.span_of(key), &self.path_of(key), problem);
    }

    /// Records that a key is missing, if it is; after a syntax error it may only have been lost, and nothing is said.
    pub fn require(&mut self, key: &'static str, expected: &str) {
        self.asked.push(key);
        if !self.has(key) && !self.report.has_syntax_errors() {
            self.mistake(key, Problem::new(Place::default(), "missing key").expected(expected));
        }
    }

    /// A number that keeps a rule; integers count as numbers.
    pub fn number(&mut self, key: &'static str, rule: &NumberRule) -> Option<Spanned<f64>> {
        let value = self.ask(key)?;
        let number = number_of(value, &|| self.path_of(key), rule, self.report)?;
        Some(Spanned { value: number, span: value.span() })
    }

    /// Three numbers that each keep a rule.
    pub fn vec3(&mut self, key: &'static str, rule: &NumberRule) -> Option<Spanned<DVec3>> {
        let value = self.ask(key)?;
        let numbers = numbers_of::<3>(value, &|| self.path_of(key), rule, self.report)?;
        Some(Spanned { value: DVec3::from_array(numbers), span: value.span() })
    }

    /// A number, which stands for three of it, or three numbers, that each keep a rule.
    pub fn number_or_vec3(&mut self, key: &'static str, rule: &NumberRule) -> Option<Spanned<DVec3>> {
        if matches!(self.ask(key)?.get_ref(), DeValue::Array(_)) {
            return self.vec3(key, rule);
        }
        self.number(key, rule).map(|Spanned { value, span }| Spanned { value: DVec3::splat(value), span })
    }

    /// Four rows of four numbers that each keep a rule.
    pub fn rows4(&mut self, key: &'static str, rule: &NumberRule) -> Option<Spanned<Rows4>> {
        let value = self.ask(key)?;
        let path = self.path_of(key);
        elements_of::<4>(value, &|| path.clone(), "4 rows of 4 numbers", self.report)?;
        self.affine_rows(key, rule)
    }

    /// Three or four rows of four numbers that each keep a rule; the fourth is 0, 0, 0, 1 unless given.
    pub fn affine_rows(&mut self, key: &'static str, rule: &NumberRule) -> Option<Spanned<Rows4>> {
        let value = self.ask(key)?;
        let path = self.path_of(key);
        let expected = "4 rows of 4 numbers, or the first 3 of them";
        let DeValue::Array(rows) = value.get_ref() else { return self.wrong_type(key, expected) };
        if !(3..=4).contains(&rows.len()) {
            let problem = Problem::new(Place::default(), "wrong length").found(rows.len()).expected(expected);
            self.mistake(key, problem);
            return None;
        }
        let mut matrix = [[0.0; 4], [0.0; 4], [0.0; 4], [0.0, 0.0, 0.0, 1.0]];
        let mut complete = true;
        for (row, (numbers, value)) in matrix.iter_mut().zip(rows.iter()).enumerate() {
            match numbers_of::<4>(value, &|| format!("{path}[{row}]"), rule, self.report) {
                Some(read) => *numbers = read,
                None => complete = false,
            }
        }
        complete.then(|| Spanned { value: matrix, span: value.span() })
    }

    /// An array of points, each three numbers that keep a rule.
    pub fn points(&mut self, key: &'static str, rule: &NumberRule) -> Option<Spanned<Vec<DVec3>>> {
        let value = self.ask(key)?;
        let DeValue::Array(array) = value.get_ref() else {
            return self.wrong_type(key, "an array of points, each 3 numbers");
        };
        let path = self.path_of(key);
        let points = array.iter().enumerate().map(|(row, point)| {
            numbers_of::<3>(point, &|| format!("{path}[{row}]"), rule, self.report).map(DVec3::from_array)
        });
        // Read all of them before giving up, so that every mistake is recorded.
        let points: Vec<Option<DVec3>> = points.collect();
        Some(Spanned { value: points.into_iter().collect::<Option<_>>()?, span: value.span() })
    }

    /// An array of triples of whole numbers below `n_rows`.
    pub fn index_triples(&mut self, key: &'static str, n_rows: usize) -> Option<Vec<[u32; 3]>> {
        let value = self.ask(key)?;
        let DeValue::Array(array) = value.get_ref() else {
            return self.wrong_type(key, "an array of triangles, each 3 rows of `vertices`");
        };
        let path = self.path_of(key);
        let triples = array.iter().enumerate().map(|(row, triple)| {
            let path = || format!("{path}[{row}]");
            let elements = elements_of::<3>(triple, &path, "3 rows of `vertices`", self.report)?;
            let mut indices = [0; 3];
            for (corner, (index, element)) in indices.iter_mut().zip(elements.iter()).enumerate() {
                *index = index_of(element, &|| format!("{}[{corner}]", path()), n_rows, self.report)?;
            }
            Some(indices)
        });
        let triples: Vec<Option<[u32; 3]>> = triples.collect();
        triples.into_iter().collect()
    }

    /// A whole number in a range; `expected` names it in messages.
    pub fn integer(&mut self, key: &'static str, range: std::ops::RangeInclusive<u64>, expected: &str) -> Option<u64> {
        let value = self.ask(key)?;
        let DeValue::Integer(integer) = value.get_ref() else { return self.wrong_type(key, expected) };
        let read = i128::from_str_radix(integer.as_str(), integer.radix()).ok().and_then(|n| u64::try_from(n).ok());
        match read.filter(|n| range.contains(n)) {
            Some(n) => Some(n),
            None => self.out_of_range(key, expected),
        }
    }

    /// Whole numbers in a range, as one or as an array.
    pub fn integers(
        &mut self,
        key: &'static str,
        range: std::ops::RangeInclusive<u64>,
        expected: &str,
    ) -> Option<Vec<u64>> {
        let read = |value: &Value, path: &str| match value.get_ref() {
            DeValue::Integer(integer) => {
                let read = u64::from_str_radix(integer.as_str(), integer.radix()).ok().filter(|n| range.contains(n));
                if read.is_none() {
                    let problem = Problem::new(Place::default(), "value out of range");
                    let problem = problem.found(self.report.excerpt(&value.span())).expected(expected);
                    self.report.mistake(&value.span(), path, problem);
                }
                read
            }
            _ => {
                self.report.mistake(&value.span(), path, wrong_type(value, expected, self.report));
                None
            }
        };
        let numbers = self.one_or_several(key, read);
        self.asked.push(key);
        numbers
    }

    /// Numbers that each keep a rule, as one or as an array.
    pub fn numbers(&mut self, key: &'static str, rule: &NumberRule) -> Option<Vec<f64>> {
        self.asked.push(key);
        self.one_or_several(key, |value, path| number_of(value, &|| path.to_owned(), rule, self.report))
    }

    /// The elements of an array, or the one value; all are read, so that every mistake is recorded.
    fn one_or_several<T>(&self, key: &str, read: impl Fn(&Value, &str) -> Option<T>) -> Option<Vec<T>> {
        let value = self.entries.get(key)?;
        let path = self.path_of(key);
        let all: Vec<Option<T>> = match value.get_ref() {
            DeValue::Array(array) => {
                array.iter().enumerate().map(|(row, value)| read(value, &format!("{path}[{row}]"))).collect()
            }
            _ => vec![read(value, &path)],
        };
        all.into_iter().collect()
    }

    /// `true` or `false`.
    pub fn flag(&mut self, key: &'static str) -> Option<bool> {
        let value = self.ask(key)?;
        value.get_ref().as_bool().or_else(|| self.wrong_type(key, "true or false"))
    }

    /// A string that is not empty.
    pub fn string(&mut self, key: &'static str, expected: &str) -> Option<Spanned<String>> {
        let value = self.ask(key)?;
        match value.get_ref().as_str() {
            Some("") => self.out_of_range(key, expected),
            Some(string) => Some(Spanned { value: string.to_owned(), span: value.span() }),
            None => self.wrong_type(key, expected),
        }
    }

    /// One of a few words.
    pub fn word<T: Copy>(&mut self, key: &'static str, words: &[(&str, T)]) -> Option<T> {
        let expected = one_of(words.iter().map(|&(word, _)| word));
        let Spanned { value, span } = self.string(key, &expected)?;
        self.meaning(key, &value, &span, words)
    }

    /// An array of words, each one of a few.
    pub fn words<T: Copy>(&mut self, key: &'static str, words: &[(&str, T)]) -> Option<Vec<T>> {
        let expected = || format!("an array of {}", one_of(words.iter().map(|&(word, _)| word)));
        let DeValue::Array(array) = self.ask(key)?.get_ref() else { return self.wrong_type(key, &expected()) };
        let mut meant = Vec::with_capacity(array.len().min(words.len()));
        for value in array {
            let DeValue::String(word) = value.get_ref() else { return self.wrong_type(key, &expected()) };
            meant.push(self.meaning(key, word, &value.span(), words)?);
        }
        Some(meant)
    }

    fn meaning<T: Copy>(&self, key: &str, found: &str, span: &Range<usize>, words: &[(&str, T)]) -> Option<T> {
        let meant = words.iter().find(|(word, _)| *word == found).map(|&(_, meant)| meant);
        if meant.is_none() {
            let mut problem = Problem::new(Place::default(), format!("unknown {key}"))
                .found(format!("\"{found}\""))
                .expected(one_of(words.iter().map(|&(word, _)| word)));
            if let Some(near) = nearest(found, words.iter().map(|(word, _)| *word)) {
                problem = problem.help(format!("did you mean \"{near}\"?"));
            }
            self.report.mistake(span, &self.path_of(key), problem);
        }
        meant
    }

    /// A key of any value that is accepted and ignored.
    pub fn ignore(&mut self, key: &'static str) {
        self.asked.push(key);
    }

    /// A table inside this one.
    pub fn table(&mut self, key: &'static str) -> Option<Table<'t>> {
        let value = self.ask(key)?;
        match value.get_ref() {
            DeValue::Table(entries) => Some(self.child(entries, value.span(), self.path_of(key))),
            _ => self.wrong_type(key, &format!("a table, [{key}]")),
        }
    }

    /// The tables of an array of tables, in the order of the file.
    pub fn tables(&mut self, key: &'static str) -> Vec<Table<'t>> {
        let expected = format!("tables, each under [[{key}]]");
        let Some(value) = self.ask(key) else { return Vec::new() };
        let DeValue::Array(array) = value.get_ref() else {
            return self.wrong_type(key, &expected).unwrap_or_default();
        };
        let mut tables = Vec::with_capacity(array.len());
        for (index, value) in array.iter().enumerate() {
            let path = format!("{}[{index}]", self.path_of(key));
            match value.get_ref() {
                DeValue::Table(entries) => tables.push(self.child(entries, value.span(), path)),
                _ => self.report.mistake(&value.span(), &path, wrong_type(value, &expected, self.report)),
            }
        }
        tables
    }

    /// Records every key that was never asked for, with the nearest one that was.
    pub fn finish(self) {
        for key in self.entries.keys() {
            let name: &str = key.get_ref();
            if !self.asked.contains(&name) {
                let help = match nearest(name, self.asked.iter().copied()) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => format!("known here: {}", self.asked.join(", ")),
                };
                let problem = Problem::new(Place::default(), "unknown key").help(help);
                self.report.mistake(&key.span(), &self.path_of(name), problem);
            }
        }
    }

    fn ask(&mut self, key: &'static str) -> Option<&'t Value<'t>> {
        if !self.asked.contains(&key) {
            self.asked.push(key);
        }
        self.entries.get(key)
    }

    fn child(&self, entries: &'t DeTable<'t>, span: Range<usize>, path: String) -> Table<'t> {
        Table { entries, span, path, asked: Vec::new(), report: self.report }
    }

    fn wrong_type<T>(&self, key: &str, expected: &str) -> Option<T> {
        let value = self.entries.get(key)?;
        self.mistake(key, wrong_type(value, expected, self.report));
        None
    }

    fn out_of_range<T>(&self, key: &str, expected: &str) -> Option<T> {
        let found = self.report.excerpt(&self.span_of(key));
        self.mistake(key, Problem::new(Place::default(), "value out of range").found(found).expected(expected));
        None
    }
}

/// `"a", "b" or "c"`.
pub fn one_of<'a>(words: impl Iterator<Item = &'a str>) -> String {
    let quoted: Vec<String> = words.map(|word| format!("\"{word}\"")).collect();
    match &quoted[..] {
        [] => String::new(),
        [word] => word.clone(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

fn wrong_type(value: &Value<'_>, expected: &str, report: &Report) -> Problem {
    let excerpt = report.excerpt(&value.span());
    let found = match value.get_ref() {
        DeValue::String(_) => format!("the string {excerpt}"),
        DeValue::Integer(_) | DeValue::Float(_) => format!("the number {excerpt}"),
        DeValue::Boolean(_) => excerpt,
        DeValue::Datetime(_) => format!("the date {excerpt}"),
        DeValue::Array(_) => format!("the array {excerpt}"),
        DeValue::Table(_) => "a table".to_owned(),
    };
    Problem::new(Place::default(), "wrong type").found(found).expected(expected)
}

fn number_of(value: &Value<'_>, path: &dyn Fn() -> String, rule: &NumberRule, report: &Report) -> Option<f64> {
    let number = match value.get_ref() {
        DeValue::Integer(integer) => i128::from_str_radix(integer.as_str(), integer.radix())
            .map(|n| n as f64)
            .or_else(|_| integer.as_str().parse::<f64>())
            .unwrap_or(f64::NAN),
        DeValue::Float(float) => float.as_str().parse::<f64>().unwrap_or(f64::NAN),
        _ => {
            report.mistake(&value.span(), &path(), wrong_type(value, rule.expected, report));
            return None;
        }
    };
    if number.is_finite() && (rule.holds)(number) {
        return Some(number);
    }
    let what = if number.is_finite() { "value out of range" } else { "not a finite number" };
    let found = report.excerpt(&value.span());
    report.mistake(&value.span(), &path(), Problem::new(Place::default(), what).found(found).expected(rule.expected));
    None
}

fn index_of(value: &Value<'_>, path: &dyn Fn() -> String, n_rows: usize, report: &Report) -> Option<u32> {
    let expected = match n_rows {
        0 => "no row: there are no vertices".to_owned(),
        n => format!("a row of `vertices`, 0 to {}", n - 1),
    };
    let DeValue::Integer(integer) = value.get_ref() else {
        report.mistake(&value.span(), &path(), wrong_type(value, &expected, report));
        return None;
    };
    let index = u32::from_str_radix(integer.as_str(), integer.radix()).ok().filter(|&row| (row as usize) < n_rows);
    if index.is_none() {
        let problem = Problem::new(Place::default(), "index out of range");
        report.mistake(&value.span(), &path(), problem.found(report.excerpt(&value.span())).expected(expected));
    }
    index
}

fn elements_of<'v, const N: usize>(
    value: &'v Value<'v>,
    path: &dyn Fn() -> String,
    expected: &str,
    report: &Report,
) -> Option<&'v DeArray<'v>> {
    let DeValue::Array(array) = value.get_ref() else {
        report.mistake(&value.span(), &path(), wrong_type(value, expected, report));
        return None;
    };
    if array.len() != N {
        let problem = Problem::new(Place::default(), "wrong length").found(array.len()).expected(expected);
        report.mistake(&value.span(), &path(), problem);
        return None;
    }
    Some(array)
}

fn numbers_of<const N: usize>(
    value: &Value<'_>,
    path: &dyn Fn() -> String,
    rule: &NumberRule,
    report: &Report,
) -> Option<[f64; N]> {
    let elements = elements_of::<N>(value, path, &format!("{N} numbers"), report)?;
    let mut numbers = [0.0; N];
    let mut complete = true;
    for (index, (number, element)) in numbers.iter_mut().zip(elements.iter()).enumerate() {
        match number_of(element, &|| format!("{}[{index}]", path()), rule, report) {
            Some(read) => *number = read,
            None => complete = false,
        }
    }
    complete.then_some(numbers)
}
