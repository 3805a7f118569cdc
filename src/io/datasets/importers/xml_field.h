// SPDX-License-Identifier: Apache-2.0
// An XML file and its elements, with limits, so that each error names the file and the element. The only user of pugixml.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ewa::io {

class XmlField;

/// A file of at most 256 MiB. Nothing outside it is read: a document type is skipped, and its entities stay as they are.
class XmlFile {
  public:
    /// Throws InputError that names the file and the byte.
    explicit XmlFile(const std::filesystem::path& path);
    ~XmlFile();
    XmlFile(const XmlFile&) = delete;
    XmlFile& operator=(const XmlFile&) = delete;

    /// The document's root element.
    XmlField top() const;

  private:
    friend class XmlField;
    struct State;
    std::unique_ptr<State> state_;
};

/// An element. It is valid as long as its file.
class XmlField {
  public:
    const std::string& where() const { return where_; }
    std::string_view name() const;
    bool has(const char* child) const { return find(child).has_value(); }
    /// The first child of that name.
    std::optional<XmlField> find(const char* child) const;
    /// A required child. Its errors begin with this element's place, then `what` if that is not empty. Throws if it is missing.
    XmlField at(const char* child, const std::string& what = {}) const;
    /// All child elements, or only those of this name if it is not null.
    std::vector<XmlField> children(const char* name = nullptr) const;
    /// The text of an attribute or of the element; empty if there is none.
    std::string attribute(const char* name) const;
    std::string text() const;
    /// The names and values of all attributes.
    std::vector<std::pair<std::string_view, std::string_view>> attributes() const;

    /// The element's text as a finite number.
    double number() const;
    /// A child's number, or `absent` without the child.
    double number(const char* child, double absent) const;
    /// The element's text as `count` finite numbers, between white space.
    std::vector<double> numbers(size_t count) const;
    /// An attribute as a side of an image in px.
    int side(const char* attribute) const;

    /// The same element under another name in errors.
    XmlField called(const std::string& where) const;
    [[noreturn]] void fail(const std::string& text) const;

  private:
    friend class XmlFile;
    XmlField(const void* node, std::string where) : node_(node), where_(std::move(where)) {}

    const void* node_;  // pugixml's
    std::string where_;
};

/// `count` finite numbers between white space; empty if the text is anything else.
std::optional<std::vector<double>> numbers_in(std::string_view text, size_t count);

}  // namespace ewa::io
