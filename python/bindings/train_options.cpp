// SPDX-License-Identifier: Apache-2.0
#include "train_options.h"

#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <variant>
#include <vector>

#include "bindings.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/gaussians.h"
#include "options.h"

namespace ewa::python {
namespace {

namespace nb = nanobind;
using Json = nlohmann::ordered_json;

template <class T>
using OptionMember = T TrainOptions::*;

/// A number or a flag with its range.
struct Field {
    const char* name;
    std::variant<OptionMember<int>, OptionMember<uint32_t>, OptionMember<uint64_t>, OptionMember<double>,
                 OptionMember<bool>>
        member;
    double low = 0, high = 1e9;
};

constexpr double kMost = 1e18;

const std::vector<Field>& fields() {
    using O = TrainOptions;
    static const std::vector<Field> all = {
        {"steps", &O::steps, 1, 1e9},
        {"batch", &O::batch, 1, 256},
        {"bands", &O::bands, 1, 64},
        {"seed", &O::seed, 0, kMost},
        {"image_cache_bytes", &O::image_cache_bytes, 0, kMost},
        {"device_memory_bytes", &O::device_memory_bytes, 0, kMost},
        {"means_rate", &O::means_rate},
        {"means_rate_final", &O::means_rate_final},
        {"sh0_rate", &O::sh0_rate},
        {"sh_rest_rate", &O::sh_rest_rate},
        {"opacity_rate", &O::opacity_rate},
        {"scale_rate", &O::scale_rate},
        {"quaternion_rate", &O::quaternion_rate},
        {"short_run_power", &O::short_run_power},
        {"few_photos", &O::few_photos},
        {"exposure", &O::exposure},
        {"exposure_rate", &O::exposure_rate},
        {"exposure_rate_final", &O::exposure_rate_final},
        {"refine_poses", &O::refine_poses},
        {"refine_focal", &O::refine_focal},
        {"pose_rate", &O::pose_rate},
        {"pose_rate_final", &O::pose_rate_final},
        {"refine_start", &O::refine_start},
        {"refine_stop", &O::refine_stop},
        {"refine_every", &O::refine_every, 1},
        {"opacity_reset_every", &O::opacity_reset_every},
        {"sh_degree_every", &O::sh_degree_every, 1},
        {"halvings", &O::halvings, 0, 6},
        {"resolution_every", &O::resolution_every, 1},
        {"grow_gradient", &O::grow_gradient},
        {"absolute_gradients", &O::absolute_gradients},
        {"grow_gradient_absolute", &O::grow_gradient_absolute},
        {"revised_opacity", &O::revised_opacity},
        {"split_scale", &O::split_scale},
        {"prune_opacity", &O::prune_opacity, 1e-6, 0.999},
        {"prune_scale", &O::prune_scale},
        {"relocate_stop", &O::relocate_stop},
        {"growth", &O::growth, 1, 1000},
        {"copy_spread", &O::copy_spread},
        {"dead_opacity", &O::dead_opacity, 1e-6, 0.999},
        {"noise_rate", &O::noise_rate, 0, kMost},
        {"opacity_weight", &O::opacity_weight},
        {"scale_weight", &O::scale_weight},
    };
    return all;
}

/// An option whose values are not one number.
struct Special {
    const char* name;
    const char* type;
    std::function<nb::object(const TrainOptions&)> get;
    std::function<void(TrainOptions&, nb::handle)> set;
};

const std::vector<std::pair<const char*, Strategy>> kStrategies{{"auto", Strategy::automatic},
                                                                {"adc", Strategy::adc},
                                                                {"mcmc", Strategy::mcmc},
                                                                {"none", Strategy::none}};

nb::object strategy_word(const TrainOptions& options) {
    for (const auto& [word, strategy] : kStrategies)
        if (strategy == options.strategy) return nb::str(word);
    return nb::none();
}

void set_strategy(TrainOptions& options, nb::handle value) {
    auto word = nb::cast<std::string>(value);
    std::vector<std::string> words;
    for (const auto& known : kStrategies) words.emplace_back(known.first);
    if (const std::string problem = core::settle_word(word, words); !problem.empty())
        throw InputError(problem);
    options.strategy =
        kStrategies[size_t(std::find(words.begin(), words.end(), word) - words.begin())].second;
}

void set_degree(TrainOptions& options, nb::handle value) {
    if (nb::isinstance<nb::str>(value) && nb::cast<std::string>(value) == "auto") {
        options.sh_degree = kAutomaticShDegree;
        return;
    }
    const int degree = nb::cast<int>(value);
    if (degree < 0 || degree > kMaxShDegree) throw InputError("is not 0, 1, 2, 3 or \"auto\"");
    options.sh_degree = degree;
}

void set_max_splats(TrainOptions& options, nb::handle value) {
    constexpr double kMostSplats = 1e9;
    if (nb::isinstance<nb::str>(value) && nb::cast<std::string>(value) == "auto") {
        options.max_splats = kAutomaticMaxSplats;
        return;
    }
    const double splats = nb::cast<double>(value);  // 7e3 is a whole number, too
    if (!(splats >= 1 && splats <= kMostSplats && splats == std::floor(splats)))
        throw InputError("is no whole number from 1 to " + core::shown_number(kMostSplats) +
                         ", nor \"auto\"");
    options.max_splats = uint32_t(splats);
}

void set_moments(TrainOptions& options, nb::handle value) {
    const int bits = nb::cast<int>(value);
    if (bits != 16 && bits != 32) throw InputError("is neither 16 nor 32");
    options.moment_bits = bits;
}

nb::object background_value(const TrainOptions& options) {
    if (options.random_background) return nb::str("random");
    const auto& [r, g, b] = options.render.background;
    return nb::make_tuple(r, g, b);
}

void set_background(TrainOptions& options, nb::handle value) {
    options.random_background = nb::isinstance<nb::str>(value) && nb::cast<std::string>(value) == "random";
    options.render.background = options.random_background ? std::array<float, 3>{} : background_of(value);
}

nb::object kernel_word(const TrainOptions& options) {
    return nb::str(kernel_words()[size_t(options.render.kernel)].c_str());
}

void set_kernel(TrainOptions& options, nb::handle value) {
    std::string word = nb::cast<std::string>(value);
    if (const std::string problem = core::settle_word(word, kernel_words()); !problem.empty())
        throw InputError(problem);
    options.render.kernel = Footprint(std::ranges::find(kernel_words(), word) - kernel_words().begin());
}

const std::vector<Special>& specials() {
    static const std::vector<Special> all = {
        {"strategy", "typing.Literal['auto', 'adc', 'mcmc', 'none']", strategy_word, set_strategy},
        {"sh_degree", "int | typing.Literal['auto']",
         [](const TrainOptions& o) -> nb::object {
             if (o.sh_degree == kAutomaticShDegree) return nb::str("auto");
             return nb::int_(o.sh_degree);
         },
         set_degree},
        {"max_splats", "int | typing.Literal['auto']",
         [](const TrainOptions& o) -> nb::object {
             if (o.max_splats == kAutomaticMaxSplats) return nb::str("auto");
             return nb::int_(o.max_splats);
         },
         set_max_splats},
        {"moment_bits", "typing.Literal[16, 32]",
         [](const TrainOptions& o) -> nb::object { return nb::int_(o.moment_bits); }, set_moments},
        {"background", "numpy.typing.ArrayLike | str", background_value, set_background},
        {"antialias", "bool",
         [](const TrainOptions& o) -> nb::object {
             return nb::bool_(o.render.kernel == Footprint::antialias);
         },
         [](TrainOptions& o, nb::handle value) { o.render.kernel = footprint_of(nb::cast<bool>(value)); }},
        {"kernel", "typing.Literal['peak', 'antialias', 'density']", kernel_word, set_kernel},
    };
    return all;
}

template <class T>
void set_number(T& member, const Field& field, nb::handle value) {
    if constexpr (std::is_same_v<T, bool>) {
        member = nb::cast<bool>(value);
    } else {
        // 7e3 is a whole number, too.
        const double number = nb::cast<double>(value);
        if (!(number >= field.low && number <= field.high))
            throw InputError("is not from " + core::shown_number(field.low) + " to " +
                             core::shown_number(field.high));
        if (std::is_integral_v<T> && number != std::floor(number)) throw InputError("is no whole number");
        member = nb::isinstance<nb::int_>(value) ? nb::cast<T>(value) : T(number);
    }
}

template <class T>
nb::object python_value(T value) {
    if constexpr (std::is_same_v<T, bool>) return nb::bool_(value);
    if constexpr (std::is_same_v<T, double>) return nb::float_(value);
    return nb::int_(value);
}

template <class T>
constexpr const char* type_name() {
    return std::is_same_v<T, bool> ? "bool" : std::is_same_v<T, double> ? "float" : "int";
}

[[noreturn]] void unknown_option(const std::string& name) {
    std::vector<std::string> known;
    for (const Field& field : fields()) known.emplace_back(field.name);
    for (const Special& special : specials()) known.emplace_back(special.name);
    throw nb::type_error(("Trainer has no option " + name + core::did_you_mean(name, known)).c_str());
}

void set_known(TrainOptions& options, const std::string& name, nb::handle value) {
    for (const Special& special : specials())
        if (name == special.name) return special.set(options, value);
    for (const Field& field : fields())
        if (name == field.name)
            return std::visit([&](auto member) { set_number(options.*member, field, value); }, field.member);
    unknown_option(name);
}

Json json_of(nb::handle value) {
    if (nb::isinstance<nb::str>(value)) return nb::cast<std::string>(value);
    if (nb::isinstance<nb::bool_>(value)) return nb::cast<bool>(value);
    if (nb::isinstance<nb::int_>(value)) return nb::cast<uint64_t>(value);
    if (nb::isinstance<nb::float_>(value)) return nb::cast<double>(value);
    return nb::cast<std::array<float, 3>>(value);
}

nb::object object_of(const Json& json) {
    if (json.is_string()) return nb::str(json.get<std::string>().c_str());
    if (json.is_boolean()) return nb::bool_(json.get<bool>());
    if (json.is_number_unsigned()) return nb::int_(json.get<uint64_t>());
    if (json.is_number()) return nb::float_(json.get<double>());
    if (json.is_array() && json.size() == 3 && json[0].is_number() && json[1].is_number() &&
        json[2].is_number())
        return nb::make_tuple(json[0].get<double>(), json[1].get<double>(), json[2].get<double>());
    return nb::none();
}

}  // namespace

TrainOptions usual_options() {
    return {.strategy = Strategy::automatic, .sh_degree = kAutomaticShDegree};
}

void set_option(TrainOptions& options, const std::string& name, nb::handle value) {
    try {
        set_known(options, name, value);
    } catch (const nb::cast_error&) {
        throw nb::type_error((name + "=" + nb::repr(value).c_str() + " is of the wrong type").c_str());
    } catch (const InputError& error) {
        throw InputError(name + "=" + nb::repr(value).c_str() + ": " + error.what());
    }
}

nb::dict options_dict(const TrainOptions& options) {
    nb::dict all;
    for (const Special& special : specials()) all[special.name] = special.get(options);
    for (const Field& field : fields())
        std::visit([&](auto member) { all[field.name] = python_value(options.*member); }, field.member);
    return all;
}

std::string option_parameters() {
    const TrainOptions usual = usual_options();
    std::string text;
    const auto add = [&](const char* name, const char* type, const nb::object& value) {
        text.append(", ").append(name).append(": ").append(type).append(" = ").append(
            nb::repr(value).c_str());
    };
    for (const Special& special : specials()) add(special.name, special.type, special.get(usual));
    for (const Field& field : fields())
        std::visit(
            [&](auto member) {
                using T = std::decay_t<decltype(usual.*member)>;
                add(field.name, type_name<T>(), python_value(usual.*member));
            },
            field.member);
    return text;
}

Json options_json(const TrainOptions& options) {
    Json json;
    for (const auto& [name, value] : options_dict(options))
        json[nb::cast<std::string>(name)] = json_of(value);
    return json;
}

void read_options(const Json& json, TrainOptions& options) {
    for (const auto& [name, value] : options_dict(options)) {
        const auto key = nb::cast<std::string>(name);
        if (!json.contains(key)) throw InputError("its settings lack " + key);
        try {
            set_option(options, key, object_of(json[key]));
        } catch (const nb::builtin_exception&) {
            throw InputError("its settings have a wrong value of " + key);
        }
    }
}

}  // namespace ewa::python
