// SPDX-License-Identifier: Apache-2.0
// No shader loops without bound: each loop counts up to what it does not change, or halves a range. What this
// reads is the loops' form. That a range begins the right way round, and that a counter does not pass the
// largest number within its step, is the capacities' business (src/pipeline/sizes.h).
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

std::string without_comments(const std::string& source) {
    return std::regex_replace(source, std::regex(R"(//[^\n]*|/\*[^]*?\*/)"), "");
}

/// From an opening bracket to behind the one that closes it.
size_t past_bracket(const std::string& text, size_t at) {
    int depth = 0;
    for (; at < text.size(); ++at) {
        if (text[at] == '(' || text[at] == '{') ++depth;
        if ((text[at] == ')' || text[at] == '}') && --depth == 0) return at + 1;
    }
    return at;
}

/// A block, or what ends at the first semicolon outside of brackets; with what `else` adds to it.
std::string statement_at(const std::string& text, size_t begin) {
    begin = std::min(text.find_first_not_of(" \t\n", begin), text.size());
    size_t end = begin;
    for (;;) {
        if (end < text.size() && text[end] == '{') {
            end = past_bracket(text, end);
        } else {
            while (end < text.size() && text[end] != ';')
                end = text[end] == '(' || text[end] == '{' ? past_bracket(text, end) : end + 1;
            end = std::min(end + 1, text.size());
        }
        const size_t next = text.find_first_not_of(" \t\n", end);
        if (next == std::string::npos || text.compare(next, 4, "else") != 0) break;
        end = text.find_first_not_of(" \t\n", next + 4);
    }
    return text.substr(begin, end - begin);
}

/// a[b[i]].c without what is in brackets, so that an assignment stands next to the name of what it changes.
std::string without_indices(std::string text) {
    static const std::regex innermost(R"(\[[^\[\]]*\])");
    while (std::regex_search(text, innermost)) text = std::regex_replace(text, innermost, "");
    return text;
}

/// The functions that change what they are given, and which of their arguments.
using Changers = std::map<std::string, std::vector<size_t>>;

/// What stands between commas, from behind an opening bracket to the one that closes it.
std::vector<std::string> arguments_at(const std::string& text, size_t begin) {
    const size_t end = past_bracket(text, begin - 1) - 1;
    std::vector<std::string> found(1);
    int depth = 0;
    for (size_t at = begin; at < end; ++at) {
        if (text[at] == '(') ++depth;
        if (text[at] == ')') --depth;
        if (text[at] == ',' && depth == 0)
            found.emplace_back();
        else
            found.back() += text[at];
    }
    return found;
}

bool changes(const std::string& text, const std::string& name, const Changers& changers) {
    const std::string plain = without_indices(text), whole = R"(\b)" + name + R"(\b)", member = R"((\.\w+)*)";
    const auto has = [&](const std::string& form) { return std::regex_search(plain, std::regex(form)); };
    if (has(whole + member + R"(\s*\)*\s*([-+*/%&|^]|<<|>>)?=[^=])") || has(R"((\+\+|--)\s*\(*)" + whole) ||
        has(whole + member + R"(\s*\)*\s*(\+\+|--))"))
        return true;
    const std::regex argument(R"(\s*)" + name + member + R"(\s*)");
    for (const auto& [changer, changed] : changers) {
        const std::regex call(R"(\b)" + changer + R"(\()");
        for (std::sregex_iterator at(plain.begin(), plain.end(), call), end; at != end; ++at) {
            const auto given = arguments_at(plain, size_t(at->position() + at->length()));
            for (const size_t i : changed)
                if (i < given.size() && std::regex_match(given[i], argument)) return true;
        }
    }
    return false;
}

/// Whether something that the expression names is changed.
bool changes_any_of(const std::string& text, const std::string& expression, const Changers& changers) {
    static const std::regex name(R"([A-Za-z_]\w*)");
    for (std::sregex_iterator at(expression.begin(), expression.end(), name), end; at != end; ++at)
        if (changes(text, at->str(), changers)) return true;
    return false;
}

/// Of a for: its counter, a whole number, grows by 1 or by a constant, and the condition is false from some
/// value on.
bool counts_up(const std::string& header, const std::string& body, const Changers& changers) {
    static const std::regex parts(R"(\(([^;]*);([^;]*);([^;]*)\))");
    static const std::regex step(R"(\s*(?:\+\+(\w+)|(\w+) \+= (?:[1-9]\d{0,5}u?|[A-Z][A-Z_]*))\s*)");
    static const std::regex start(R"((\s*(?:uint|int) .*)?)");
    std::smatch part, stepped;
    if (!std::regex_match(header, part, parts)) return false;
    const std::string first = part[1], condition = part[2], third = part[3];
    if (!std::regex_match(first, start) || !std::regex_match(third, stepped, step)) return false;
    const std::string counter = stepped[1].matched ? stepped[1] : stepped[2];
    // At most a constant, or under what may be the largest number.
    const std::regex form("(?:^|&&)\\s*" + counter +
                          R"( (?:<= ([A-Z][A-Z_]*|\d{1,6}u?)|< ([^&|]+?))\s*(?:$|&&))");
    std::smatch bounded;
    if (condition.find("||") != std::string::npos || !std::regex_search(condition, bounded, form))
        return false;
    const std::string bound = bounded[1].matched ? bounded[1] : bounded[2];
    static const std::regex call(R"(\b(?!(?:min|max|uint|int)\b)\w+\()");
    if (std::regex_search(bound, std::regex(R"(\b)" + counter + R"(\b)")) || std::regex_search(bound, call))
        return false;
    // What the body adds to the counter brings the end nearer.
    const std::regex added(R"(\b)" + counter + R"( \+= (?:[1-9]\d{0,5}u?|[A-Z][A-Z_]*);)");
    const std::string rest = condition + ";" + std::regex_replace(body, added, "");
    return !changes(rest, counter, changers) && !changes_any_of(rest, bound, changers);
}

/// Of a while: the range from low to high becomes smaller each time, and by half.
bool halves(const std::string& header, const std::string& body) {
    static const std::regex condition(R"(\((?:(\w+) < (\w+)|(\w+) - (\w+) > 1u)\))");
    std::smatch names;
    if (!std::regex_match(header, names, condition)) return false;
    const bool empties = names[1].matched;  // else one is left
    const std::string low = empties ? names[1] : names[4], high = empties ? names[2] : names[3];
    const std::regex shape(
        R"(\{\s*const uint middle = \()" + low + R"( \+ )" + high + R"(\) / 2u;\s*if \(.+\)\s*)" + low +
        (empties ? R"( = middle \+ 1u;)" : " = middle;") + R"(\s*else\s+)" + high + R"( = middle;\s*\})");
    return std::regex_match(body, shape);
}

/// The text without its loops.
std::string without_loops(std::string text) {
    static const std::regex word(R"(\b(for|while)\b)");
    for (std::smatch loop; std::regex_search(text, loop, word);) {
        const auto begin = size_t(loop.position());
        const size_t after = past_bracket(text, text.find('(', begin));
        const size_t body = std::min(text.find_first_not_of(" \t\n", after), text.size());
        text.replace(begin, body + statement_at(text, after).size() - begin, ";");
    }
    return text;
}

/// Of a do: a statement of the body itself lets the counter grow, and no `continue` passes it by.
bool do_counts_up(const std::string& body, const std::string& condition, const Changers& changers) {
    if (body.empty() || body[0] != '{') return false;
    std::string flat = without_loops(body.substr(1, body.size() - 2));
    if (std::regex_search(flat, std::regex(R"(\b(do|continue)\b)"))) return false;
    for (size_t open; (open = flat.find('{')) != std::string::npos;)
        flat.replace(open, past_bracket(flat, open) - open, ";");
    static const std::regex growing(R"((?:^|;)\s*((\w+) \+= [^;]+);)");
    for (std::sregex_iterator at(flat.begin(), flat.end(), growing), end; at != end; ++at) {
        std::string header = "(;";
        header.append(condition, 1, condition.size() - 2).append("; ").append((*at)[1]).append(")");
        if (counts_up(header, body, changers)) return true;
    }
    return false;
}

Changers changers_in(const std::string& source) {
    static const std::regex function(R"(\b(\w+)\((?=[^(){};]*\b(?:inout|out) ))"),
        changed(R"(\s*(?:inout|out) )");
    Changers found = {
        {R"(atomic[A-Z]\w*)", {0}}, {"umulExtended", {2, 3}}, {"uaddCarry", {2}}, {"modf", {1}}};
    for (std::sregex_iterator at(source.begin(), source.end(), function), end; at != end; ++at) {
        std::vector<size_t>& arguments = found[(*at)[1]];
        const auto parameters = arguments_at(source, size_t(at->position() + at->length()));
        for (size_t i = 0; i < parameters.size(); ++i)
            if (std::regex_search(parameters[i], changed)) arguments.push_back(i);
    }
    return found;
}

/// The loops that are not known to end. changers: those of other files.
std::vector<std::string> unbounded(const std::string& shader, Changers changers = {}, int* loops = nullptr) {
    const std::string source = without_comments(shader);
    changers.merge(changers_in(source));
    static const std::regex word(R"(\b(for|while|do)\b)");
    std::vector<std::string> found;
    std::set<size_t> ends_of_do;
    for (std::sregex_iterator at(source.begin(), source.end(), word), end; at != end; ++at) {
        if (ends_of_do.contains(size_t(at->position()))) continue;
        if (loops) ++*loops;
        if (at->str() == "do") {
            const size_t begin = source.find_first_not_of(" \t\n", size_t(at->position()) + 2);
            const std::string body = statement_at(source, begin);
            const size_t last = source.find("while", begin + body.size());
            if (last == std::string::npos) return {"do without while"};
            ends_of_do.insert(last);
            const size_t open = source.find('(', last);
            const std::string condition = source.substr(open, past_bracket(source, open) - open);
            if (!do_counts_up(body, condition, changers)) found.push_back("do ... while " + condition);
            continue;
        }
        const size_t bracket = source.find_first_not_of(" \t\n", size_t(at->position() + at->length()));
        if (bracket == std::string::npos || source[bracket] != '(') {
            found.push_back(at->str());
            continue;
        }
        const size_t after = past_bracket(source, bracket);
        const std::string header = source.substr(bracket, after - bracket),
                          body = statement_at(source, after);
        if (at->str() == "for" ? !counts_up(header, body, changers) : !halves(header, body))
            found.push_back(at->str() + " " + header);
    }
    return found;
}

TEST(ShaderLoops, EveryOneEnds) {
    std::map<std::string, std::string> sources;
    Changers changers;
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(EWA_SOURCE_DIR) / "shaders")) {
        if (!entry.is_regular_file()) continue;
        std::ostringstream source;
        source << std::ifstream(entry.path()).rdbuf();
        sources[entry.path().filename().string()] = source.str();
        changers.merge(changers_in(without_comments(source.str())));
    }
    int loops = 0;
    for (const auto& [file, source] : sources)
        for (const std::string& loop : unbounded(source, changers, &loops))
            ADD_FAILURE() << file << ": not known to end: " << loop;
    EXPECT_GT(sources.size(), 50u);
    EXPECT_GT(loops, 80);
}

TEST(ShaderLoops, WhatMayNotEndIsFound) {
    for (const char* good : {
             "for (uint i = 0; i < n; ++i) a[i] = i;",
             "[[unroll]] for (int d = 1; d <= RADIUS; ++d) { s += d; }",
             "for (uint b = first(); open && b < ends[tile + 1u]; b += SUBGROUP) { k = b; }",
             "for (uint i = 0; i < min(n, uint(m)); ++i) { if (x) a(i); else b[c[i]] = i + 1u; }",
             "for (uint i = 0; i < n; ++i) for (uint j = i; j < m; j += 2u) x[j] += x[i];",
             "for (uint k = 0; k < n; k += BLOCK) { if (shut) { k += BLOCK; break; } }",
             "while (low < high) { const uint middle = (low + high) / 2u; if (keys[middle] < tile) "
             "low = middle + 1u; else high = middle; }",
             "while (b - a > 1u) { const uint middle = (a + b) / 2u; if (f(middle)) a = middle; else b = "
             "middle; }",
             "do { a(i); i += TILE; } while (i < n);",
             "do { for (uint j = 0; j < m; ++j) { if (x) continue; } if (y) { break; } k += 8u; } while (k < "
             "n);",
             "// for (;;)\n/* while (true) */ forward = done;",
         })
        EXPECT_EQ(unbounded(good).size(), 0u) << good;
    for (const char* bad : {
             "for (;;) { if (done()) break; }",
             "for (uint i = 0; open; ++i) a[i] = 0;",
             "for (uint i = 0; i < n || open; ++i) a[i] = 0;",
             "for (uint i = 0; i <= n; ++i) a[i] = 0;",  // n may be the largest number
             "for (uint i = 0; i < n; i += step) a[i] = 0;",
             "for (uint i = 0; i < n; i -= 1u) a[i] = 0;",
             "for (uint i = 0; j < n; ++i) a[i] = 0;",
             "for (uint i = 0; i < n; ++i) { if (again) --i; }",
             "for (uint i = 0; i < n; ++i) { i = next[i]; }",
             "for (uint i = 0; i < n; ++i) { i += step; }",
             "for (uint i = 0; i < n; ++i) n += 1u;",
             "for (uint i = 0; i < range.y; ++i) { range.y = f(i); }",
             "for (uint i = 0; i < n; ++i) for (uint j = 0; j < m; ++j) i = j;",
             "while (open) { open = f(); }",
             "while (low < high) { const uint middle = (low + high) / 2u; if (keys[middle] < tile) "
             "low = middle; else high = middle; }",
             "while (b - a > 1u) { const uint middle = (a + b) / 2u; if (f(middle)) a = middle; }",
             "do { i = next[i]; } while (i > 0);",
             "do { if (x) i += TILE; } while (i < n);",
             "do { if (x) { i += TILE; } } while (i < n);",
             "do { if (x) { continue; } i += TILE; } while (i < n);",
             "do { i += TILE; i = back(i); } while (i < n);",
             "do { i += TILE; } while (i < n || open);",
             "do { i += step; } while (i < n);",
             "for (uint i = 0; i < i + 1u; ++i) a[i] = 0;",
             "for (uint i = 0; i < ends(i); ++i) a[i] = 0;",
             "for (uint i = 0; i < n && --i < m; ++i) a[i] = 0;",
             "for (uint i = 0; i < n++; ++i) a[i] = 0;",
             "for (uint i = 0; i < n && (i = next[i]) > 0u; ++i) a[i] = 0;",
             "void back(inout uint i) { i = 0u; } void f() { for (uint i = 0; i < n; ++i) back(i); }",
             "for (uint i = 0; i < counts.n; ++i) atomicAdd(counts.n, 1u);",
             "for (uint i = 0; i < counts[0]; ++i) { counts[map[i]] += 1u; }",
             "for (uint i = 0; i < n; ++i) if (x) a(); else --i;",
             "for (uint i = 0; i < n; ++i) { (i) = 0u; }",
             "for (uint i = 0; i <= 4294967295u; ++i) a[i] = 0;",
             "for (float t = 0.0; t < far; t += 1) a = t;",
         })
        EXPECT_NE(unbounded(bad).size(), 0u) << bad;
}

}  // namespace
