"""Lidars whose drivers publish packets or messages of their own."""
