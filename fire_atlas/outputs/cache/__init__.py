"""A cache that machines share: what builds wrote, by the digest of all that they were made from."""
