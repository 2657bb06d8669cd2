#include "view_node.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>

#include "view_error.hpp"

namespace view
{
static constexpr size_t shown_max = 40;

void Node::complain(const std::string &expected) const
{
    std::string is = value_->dump();
    if (is.size() > shown_max)
        is = std::string("a ") + value_->type_name() + text(" of %zu bytes", is.size());
    throw Error(file_ + ": " + (position_.empty() ? "the whole" : position_) + ": must be " + expected + ", is " + is);
}

Node Node::operator[](const char *key) const
{
    if (!value_->is_object())
        complain(std::string("an object with \"") + key + "\"");
    auto found = value_->find(key);
    if (found == value_->end())
        throw Error(file_ + ": " + (position_.empty() ? "" : position_ + ": ") + "has no \"" + key + "\"");
    return {*found, file_, position_.empty() ? key : position_ + "." + key};
}

Node Node::operator[](size_t index) const
{
    if (index >= count())
        complain(text("a list of more than %zu entries", index));
    return {(*value_)[index], file_, position_ + text("[%zu]", index)};
}

bool Node::boolean() const
{
    if (!value_->is_boolean())
        complain("true or false");
    return value_->get<bool>();
}

std::string Node::string() const
{
    if (!value_->is_string())
        complain("a string");
    return value_->get<std::string>();
}

int64_t Node::integer(int64_t min, int64_t max) const
{
    bool fits = value_->is_number_integer() && (!value_->is_number_unsigned() || value_->get<uint64_t>() <= INT64_MAX);
    if (!fits || value_->get<int64_t>() < min || value_->get<int64_t>() > max)
        complain("an integer from " + std::to_string(min) + " to " + std::to_string(max));
    return value_->get<int64_t>();
}

double Node::number() const
{
    if (!value_->is_number() || !std::isfinite(value_->get<double>()))
        complain("a number");
    return value_->get<double>();
}

double Node::fixed(int fraction_bits) const
{
    return std::ldexp(static_cast<double>(integer(INT32_MIN, INT32_MAX)), -fraction_bits);
}

size_t Node::count() const
{
    if (!value_->is_array())
        complain("a list");
    return value_->size();
}

void Node::must_count(size_t expected) const
{
    if (count() != expected)
        throw Error(file_ + ": " + position_ + text(": must have %zu entries, has %zu", expected, count()));
}

nlohmann::json json_read(const std::string &path)
{
    std::ifstream file(path, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(file), {}};
    if (!file.is_open() || file.bad())
        throw Error(path + ": " + std::strerror(errno));
    try {
        return nlohmann::json::parse(bytes);
    } catch (const nlohmann::json::parse_error &error) {
        size_t at = std::min(error.byte > 0 ? error.byte - 1 : 0, bytes.size());
        auto end = bytes.begin() + static_cast<std::ptrdiff_t>(at);
        size_t line_start = bytes.rfind('\n', at > 0 ? at - 1 : 0);
        size_t column = line_start == std::string::npos || line_start >= at ? at + 1 : at - line_start;
        throw Error(path + text(":%td:%zu: no JSON: ", std::count(bytes.begin(), end, '\n') + 1, column) +
                    (at == bytes.size() ? "it ends too soon" : "what stands here must not"));
    } catch (const nlohmann::json::exception &error) { /* of what was read well, a number too large; no position */
        std::string what = error.what();
        throw Error(path + ": " + what.substr(what.find("] ") + 2));
    }
}
} // namespace view
