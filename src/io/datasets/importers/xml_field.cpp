// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/importers/xml_field.h"

#include <cmath>
#include <pugixml.hpp>

#include "core/file_reader.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::io {

namespace {

constexpr uint64_t kMostXmlBytes = uint64_t(256) << 20;
constexpr double kMostXmlSide = 1 << 20;  // px

pugi::xml_node node_of(const void* node) {
    return pugi::xml_node(static_cast<pugi::xml_node_struct*>(const_cast<void*>(node)));
}

}  // namespace

struct XmlFile::State {
    std::string name, text;
    pugi::xml_document document;
};

XmlFile::XmlFile(const std::filesystem::path& path) : state_(std::make_unique<State>()) {
    state_->name = core::one_line(path.string());
    if (core::FileReader(path).size() > kMostXmlBytes)
        throw InputError(state_->name + ": is larger than 256 MiB");
    state_->text = core::read_text_file(path);
    const pugi::xml_parse_result result = state_->document.load_buffer_inplace(
        state_->text.data(), state_->text.size(), pugi::parse_default, pugi::encoding_auto);
    if (!result || !state_->document.document_element())
        throw InputError(
            core::one_line(state_->name + ": byte " + std::to_string(result.offset) +
                           ": not valid XML: " + (result ? "there is no element" : result.description())));
}

XmlFile::~XmlFile() = default;

XmlField XmlFile::top() const {
    return {state_->document.document_element().internal_object(), state_->name};
}

void XmlField::fail(const std::string& text) const {
    throw InputError(core::one_line(where_ + ": " + text));
}

std::string_view XmlField::name() const {
    return node_of(node_).name();
}

std::optional<XmlField> XmlField::find(const char* child) const {
    const pugi::xml_node found = node_of(node_).child(child);
    if (!found) return std::nullopt;
    return XmlField(found.internal_object(), where_ + ": <" + child + ">");
}

XmlField XmlField::at(const char* child, const std::string& what) const {
    const std::optional<XmlField> found = find(child);
    if (!found) fail(std::string("<") + child + "> is missing");
    return what.empty() ? *found : found->called(where_ + ": " + what);
}

std::vector<XmlField> XmlField::children(const char* name) const {
    std::vector<XmlField> list;
    for (const pugi::xml_node node : node_of(node_).children())
        if (node.type() == pugi::node_element && (!name || std::string_view(node.name()) == name))
            list.push_back(XmlField(node.internal_object(), where_));
    return list;
}

std::string XmlField::attribute(const char* name) const {
    return node_of(node_).attribute(name).value();
}

std::vector<std::pair<std::string_view, std::string_view>> XmlField::attributes() const {
    std::vector<std::pair<std::string_view, std::string_view>> list;
    for (const pugi::xml_attribute& attribute : node_of(node_).attributes())
        list.emplace_back(attribute.name(), attribute.value());
    return list;
}

std::string XmlField::text() const {
    return node_of(node_).child_value();
}

double XmlField::number() const {
    return numbers(1)[0];
}

double XmlField::number(const char* child, double absent) const {
    const std::optional<XmlField> found = find(child);
    return found ? found->number() : absent;
}

std::vector<double> XmlField::numbers(size_t count) const {
    const auto numbers = numbers_in(node_of(node_).child_value(), count);
    if (!numbers)
        fail(count == 1 ? std::string("is not a finite number")
                        : "is not a list of " + std::to_string(count) + " finite numbers");
    return *numbers;
}

int XmlField::side(const char* name) const {
    const auto value = numbers_in(node_of(node_).attribute(name).value(), 1);
    if (!value || !((*value)[0] >= 1 && (*value)[0] <= kMostXmlSide) ||
        (*value)[0] != std::floor((*value)[0]))
        fail(std::string("its ") + name + " is not a whole number of pixels in 1..1048576");
    return static_cast<int>((*value)[0]);
}

XmlField XmlField::called(const std::string& where) const {
    return {node_, where};
}

std::optional<std::vector<double>> numbers_in(std::string_view text, size_t count) {
    std::vector<double> numbers;
    for (std::string_view word = core::next_word(text); !word.empty(); word = core::next_word(text)) {
        const std::optional<double> number = core::parse_number(word);
        if (!number || !std::isfinite(*number) || numbers.size() == count) return std::nullopt;
        numbers.push_back(*number);
    }
    if (numbers.size() != count) return std::nullopt;
    return numbers;
}

}  // namespace ewa::io
