"""Mutation testing: which small mistakes in the product's code would the tests not notice?"""
