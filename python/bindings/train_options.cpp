// SPDX-License-Identifier: Apache-2.0
#include "train_options.h"

#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "bindings.h"
#include "core/typing.h"
#include "core/words.h"
#include "ewa/error.h"
#include "folders/former_options.h"
#include "options.h"
#include "run/loss_option.h"
#include "run/option_table.h"
#include "scene/looks.h"

namespace ewa::python {
namespace {

namespace nb = nanobind;
using Json = nlohmann::ordered_json;
using train::RunOption;

/// A number as the command line takes it. 7e3 is a whole number, too.
std::string number_text(nb::handle value) {
    const double number = nb::cast<double>(value);
    const bool whole = nb::isinstance<nb::int_>(value) && !nb::isinstance<nb::bool_>(value);
    return whole ? nb::str(value).c_str() : nb::repr(nb::float_(number)).c_str();
}

/// An option whose values have another form than on the command line.
struct Special {
    const char* name;
    const char* type;
    nb::object (*get)(const RunOptions&);
    void (*set)(RunOptions&, nb::handle);
};

nb::object background_value(const RunOptions& options) {
    if (options.train.random_background) return nb::str("random");
    if (options.train.sky) return nb::str("sky");
    if (options.automatic_background) return nb::str("auto");
    const auto& [r, g, b] = options.train.render.background;
    return nb::make_tuple(r, g, b);
}

void set_background(RunOptions& options, nb::handle value) {
    const std::string word = nb::isinstance<nb::str>(value) ? nb::cast<std::string>(value) : std::string();
    options.train.random_background = word == "random";
    options.train.sky = word == "sky";
    options.automatic_background = word == "auto";
    const bool colour = word != "random" && word != "sky" && word != "auto";
    options.train.render.background = colour ? background_of(value) : std::array<float, 3>{};
}

nb::object loss_value(const RunOptions& options) {
    return nb::str(train::loss_text(options.train.loss).c_str());
}

void set_loss(RunOptions& options, nb::handle value) {
    if (!nb::isinstance<nb::dict>(value)) {
        options.train.loss = train::parse_loss(nb::cast<std::string>(value));
        return;
    }
    std::string text;
    for (const auto& [name, weight] : nb::cast<nb::dict>(value))
        text += (text.empty() ? "" : ",") + nb::cast<std::string>(name) + "=" + number_text(weight);
    options.train.loss = train::parse_loss(text);
}

nb::object region_value(const RunOptions& options) {
    return nb::str(train::value_text(train::run_option("region"), options).c_str());
}

void set_region(RunOptions& options, nb::handle value) {
    if (!nb::isinstance<nb::str>(value)) nb::cast<std::array<double, 6>>(value);  // throws
    train::run_option("region").set(options, list_text(value));
}

/// Python's unit of memory is the byte.
template <uint64_t TrainOptions::*member>
constexpr Special bytes(const char* name) {
    return {name, "int", [](const RunOptions& o) -> nb::object { return nb::int_(o.train.*member); },
            [](RunOptions& o, nb::handle value) {
                constexpr auto kMost = uint64_t(1e18);
                std::string text = number_text(value);
                if (const std::string problem = core::settle_number(text, uint64_t(0), kMost);
                    !problem.empty())
                    throw InputError(problem);
                o.train.*member = core::parse_count<uint64_t>(text).value();
            }};
}

constexpr std::array kSpecials{
    Special{"background", "numpy.typing.ArrayLike | str", background_value, set_background},
    Special{"region", "str | collections.abc.Sequence[float]", region_value, set_region},
    Special{"loss", "str | dict[str, float]", loss_value, set_loss},
    bytes<&TrainOptions::image_cache_bytes>("image_cache_bytes"),
    bytes<&TrainOptions::device_memory_bytes>("device_memory_bytes")};

bool is_special(const std::string& name) {
    return std::ranges::any_of(kSpecials, [&](const Special& special) { return name == special.name; });
}

/// The rows that Python has as they are.
const std::vector<RunOption>& rows() {
    static const std::vector<RunOption> all = [] {
        std::vector<RunOption> found;
        for (const RunOption& row : train::run_options())
            if (!row.python.empty() && !is_special(row.python)) found.push_back(row);
        return found;
    }();
    return all;
}

nb::object object_of(const Json& json) {
    if (json.is_string()) return nb::str(json.get<std::string>().c_str());
    if (json.is_boolean()) return nb::bool_(json.get<bool>());
    if (json.is_number_unsigned()) return nb::int_(json.get<uint64_t>());
    if (json.is_number_integer()) return nb::int_(json.get<int64_t>());
    if (json.is_number()) return nb::float_(json.get<double>());
    if (json.is_array() && json.size() == 3 && json[0].is_number() && json[1].is_number() &&
        json[2].is_number())
        return nb::make_tuple(json[0].get<double>(), json[1].get<double>(), json[2].get<double>());
    return nb::none();
}

bool may_be_automatic(const RunOption& row) {
    return row.value.starts_with("auto|");
}

std::string spelled_in_python(std::string name) {
    std::ranges::replace(name, '-', '_');
    return name;
}

std::string joined(const std::vector<std::string>& parts, const char* quote) {
    std::string text;
    for (const std::string& part : parts) text += (text.empty() ? "" : ", ") + (quote + part) + quote;
    return text;
}

std::string type_of(const RunOption& row) {
    if (row.flag) return "bool";
    if (!row.choices.empty()) return "typing.Literal[" + joined(row.choices, "'") + "]";
    if (may_be_automatic(row)) return "int | typing.Literal['auto']";
    if (row.value == "16|32") return "typing.Literal[16, 32]";
    return row.get(RunOptions()).is_number_float() ? "float" : "int";
}

void set_row(RunOptions& options, const RunOption& row, nb::handle value) {
    const bool text = nb::isinstance<nb::str>(value);
    if (row.flag)
        row.flag(options) = nb::cast<bool>(value);
    else if (!row.choices.empty() ||
             (text && may_be_automatic(row) && nb::cast<std::string>(value) == "auto"))
        row.set(options, nb::cast<std::string>(value));
    else
        row.set(options, number_text(value));
}

[[noreturn]] void unknown_option(const std::string& name) {
    for (const RunOption& row : train::run_options())
        if (row.flag && row.python.empty() && spelled_in_python(row.name) == name)
            throw nb::type_error(("Trainer has no option " + name + "; ewa train has it").c_str());
    std::vector<std::string> known;
    for (const Special& special : kSpecials) known.emplace_back(special.name);
    for (const RunOption& row : rows()) known.push_back(row.python);
    throw nb::type_error(("Trainer has no option " + name + core::did_you_mean(name, known)).c_str());
}

void set_known(RunOptions& options, const std::string& name, nb::handle value) {
    for (const Special& special : kSpecials)
        if (name == special.name) return special.set(options, value);
    for (const RunOption& row : rows())
        if (name == row.python) return set_row(options, row, value);
    unknown_option(name);
}

Json json_of(nb::handle value) {
    if (nb::isinstance<nb::str>(value)) return nb::cast<std::string>(value);
    if (nb::isinstance<nb::bool_>(value)) return nb::cast<bool>(value);
    if (nb::isinstance<nb::int_>(value)) return nb::cast<uint64_t>(value);
    if (nb::isinstance<nb::float_>(value)) return nb::cast<double>(value);
    return nb::cast<std::array<float, 3>>(value);
}

/// The value that a checkpoint from before the option lacks.
void take_former(RunOptions& options, const std::string& name) {
    const auto& all = train::run_options();
    const auto row = std::ranges::find(all, name, &RunOption::python);
    if (row == all.end() || row->before.empty()) throw InputError("its settings lack " + name);
    row->set(options, row->before);
}

}  // namespace

void set_option(RunOptions& options, const std::string& name, nb::handle value) {
    try {
        set_known(options, name, value);
    } catch (const nb::cast_error&) {
        throw nb::type_error((name + "=" + nb::repr(value).c_str() + " is of the wrong type").c_str());
    } catch (const InputError& error) {
        throw InputError(name + "=" + nb::repr(value).c_str() + ": " + error.what());
    }
}

nb::dict options_dict(const RunOptions& options) {
    nb::dict all;
    for (const Special& special : kSpecials) all[special.name] = special.get(options);
    for (const RunOption& row : rows()) all[row.python.c_str()] = object_of(row.get(options));
    return all;
}

nb::dict argument_names() {
    nb::dict names;
    for (const RunOption& row : train::run_options())
        if (!row.python.empty()) names[row.name.c_str()] = row.python;
    return names;
}

RunOptions usual_options() {
    RunOptions usual;
    usual.train.appearance = AppearanceModel::none;
    return usual;
}

nb::set value_words() {
    nb::set words;
    for (const std::string& word : core::words_of(scene::kIntegratorWords)) words.add(nb::str(word.c_str()));
    for (const RunOption& row : train::run_options()) {
        for (const std::string& choice : row.choices) words.add(nb::str(choice.c_str()));
        std::istringstream parts(row.value);
        for (std::string word; std::getline(parts, word, '|');)
            if (word.find_first_not_of("abcdefghijklmnopqrstuvwxyz") == std::string::npos)
                words.add(nb::str(word.c_str()));
    }
    return words;
}

std::string option_parameters() {
    const RunOptions usual = usual_options();
    std::string text;
    const auto add = [&](const std::string& name, const std::string& type, const nb::object& value) {
        text.append(", ").append(name).append(": ").append(type).append(" = ").append(
            nb::repr(value).c_str());
    };
    for (const Special& special : kSpecials) add(special.name, special.type, special.get(usual));
    for (const RunOption& row : rows()) add(row.python, type_of(row), object_of(row.get(usual)));
    return text;
}

Json options_json(const RunOptions& options) {
    Json json;
    for (const auto& [name, value] : options_dict(options))
        json[nb::cast<std::string>(name)] = json_of(value);
    return json;
}

void read_options(const Json& stored, RunOptions& options) {
    const auto json = folders::with_present_names(stored);
    for (const auto& [name, value] : options_dict(options)) {
        const auto key = nb::cast<std::string>(name);
        try {
            if (!json.contains(key)) {
                take_former(options, key);
                continue;
            }
            set_option(options, key, object_of(json[key]));
        } catch (const nb::builtin_exception&) {
            throw InputError("its settings have a wrong value of " + key);
        }
    }
}

}  // namespace ewa::python
