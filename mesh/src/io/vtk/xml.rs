//! XML documents, with errors that name the line.

use crate::io::{Place, Problem, ReadError, cursor};
use roxmltree::{Document, Node, ParsingOptions};

/// Elements and texts of a document that are read; real files have some tens per piece.
const NODES_LIMIT: u32 = 1 << 20;

/// Attributes of an element that are read. The parser compares the names of each with those of all others.
const MOST_ATTRIBUTES: usize = 256;
/// Declarations of name spaces that are read. The parser lists those in force for each element.
const MOST_NAMESPACES: usize = 16;

/// The document in some text. Documents with their own entities are refused.
pub(in crate::io) fn parse(text: &str) -> Result<Document<'_>, ReadError> {
    if text.trim().is_empty() {
        return Err(ReadError::new(Place::File, Problem::Empty));
    }
    check_tags(text)?;
    let options = ParsingOptions { nodes_limit: NODES_LIMIT, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).map_err(|error| {
        let found = error.to_string();
        ReadError::new(
            Place::Line(error.pos().row as usize),
            Problem::Syntax { expected: "an XML document".into(), found },
        )
    })
}

/// Refuses tags that would take the parser time or memory beyond all proportion to the text.
fn check_tags(text: &str) -> Result<(), ReadError> {
    let mut n_namespaces = 0;
    let mut end = 0;
    for tag in text.split_inclusive('<') {
        let start = end;
        end += tag.len();
        let tag = tag.split('>').next().unwrap_or_default();
        if tag.starts_with(['!', '?']) {
            continue;
        }
        n_namespaces += tag.matches("xmlns").count();
        let n_attributes = tag.bytes().filter(|&b| b == b'=').count();
        for (what, found, limit) in [
            ("attributes of an element", n_attributes, MOST_ATTRIBUTES),
            ("name spaces", n_namespaces, MOST_NAMESPACES),
        ] {
            if found > limit && start > 0 {
                let line = 1 + text[..start].matches('\n').count();
                let problem = Problem::Limit { what: what.into(), found: found as u64, limit: limit as u64 };
                return Err(ReadError::new(Place::Line(line), problem));
            }
        }
    }
    Ok(())
}

/// The root of a VTK file that holds data of a type.
pub(in crate::io) fn root<'a>(document: &'a Document<'_>, kind: &'static str) -> Result<Node<'a, 'a>, ReadError> {
    let root = document.root_element();
    if root.tag_name().name() != "VTKFile" {
        let found = cursor::shown(root.tag_name().name().as_bytes());
        return Err(error(root, Problem::Syntax { expected: "the element \"VTKFile\"".into(), found }));
    }
    let found = attribute(root, "type")?;
    if found != kind {
        let found = cursor::shown(found.as_bytes());
        let expected = format!("VTK data of type {kind:?}").into();
        return Err(error(root, Problem::Syntax { expected, found }));
    }
    Ok(root)
}

/// An error in the line where an element begins.
pub(in crate::io) fn error(node: Node<'_, '_>, problem: Problem) -> ReadError {
    let line = node.document().text_pos_at(node.range().start).row;
    ReadError::new(Place::Line(line as usize), problem)
}

/// The elements of a name within another.
pub(in crate::io) fn children<'a>(node: Node<'a, 'a>, name: &'static str) -> impl Iterator<Item = Node<'a, 'a>> {
    node.children().filter(move |child| child.has_tag_name(name))
}

/// The one element of a name within another.
pub(in crate::io) fn child<'a>(node: Node<'a, 'a>, name: &'static str) -> Result<Node<'a, 'a>, ReadError> {
    let mut found = children(node, name);
    let first = found.next().ok_or_else(|| error(node, Problem::Missing(format!("element {name}").into())))?;
    match found.next() {
        Some(second) => Err(error(second, Problem::Repeated(format!("element {name}").into()))),
        None => Ok(first),
    }
}

/// An attribute that has to be there.
pub(in crate::io) fn attribute<'a>(node: Node<'a, '_>, name: &'static str) -> Result<&'a str, ReadError> {
    node.attribute(name).ok_or_else(|| error(node, Problem::Missing(format!("attribute {name}").into())))
}

/// An attribute that is a count.
pub(in crate::io) fn number(node: Node<'_, '_>, name: &'static str) -> Result<u64, ReadError> {
    let text = attribute(node, name)?.trim();
    text.parse().map_err(|_| {
        let expected = format!("a count as attribute {name}").into();
        error(node, Problem::Syntax { expected, found: cursor::shown(text.as_bytes()) })
    })
}

/// Text within an XML attribute.
pub(in crate::io) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            // White space that would read back as a blank.
            '\t' | '\n' | '\r' => escaped.push_str(&format!("&#{};", u32::from(c))),
            c => escaped.push(c),
        }
    }
    escaped
}
