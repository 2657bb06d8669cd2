/* view_node - a value of a JSON file together with its position, so that a message says where it is wrong:
 *     FILE: cuts[3].level_mm_q8: must be an integer from 0 to 4194304, is null
 * All members throw view::Error.
 */
#ifndef VIEW_NODE_HPP
#define VIEW_NODE_HPP

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace view
{
class Node
{
  public:
    Node(const nlohmann::json &value, std::string file, std::string position)
        : value_(&value), file_(std::move(file)), position_(std::move(position))
    {
    }
    Node operator[](const char *key) const;
    Node operator[](size_t index) const;
    bool is_null() const
    {
        return value_->is_null();
    }
    bool has(const char *key) const
    {
        return value_->is_object() && value_->contains(key);
    }
    bool boolean() const;
    std::string string() const;
    /* An integer within bounds. */
    int64_t integer(int64_t min, int64_t max) const;
    /* Any number that is finite. */
    double number() const;
    /* A raw integer of 32 bits with fraction_bits of them behind the point. */
    double fixed(int fraction_bits) const;
    /* How many entries the list has. */
    size_t count() const;
    void must_count(size_t expected) const;
    [[noreturn]] void complain(const std::string &expected) const;

  private:
    const nlohmann::json *value_;
    std::string file_, position_;
};

/* A whole file. Bad syntax is reported as FILE:LINE:COLUMN. */
nlohmann::json json_read(const std::string &path);
} // namespace view

#endif
